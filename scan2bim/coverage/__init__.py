"""What the scans saw of the building, what stood in the way, and where to scan next."""
