"""Model against scan: how each element of an IFC fits the points, and what could not be seen."""
