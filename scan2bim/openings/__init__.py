"""Openings in walls: doors, windows, passages."""
