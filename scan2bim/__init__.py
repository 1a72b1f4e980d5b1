"""scan2bim: laser scans of a building's inside to IFC and USD building models with evidence."""

__version__ = "0.1.0"
