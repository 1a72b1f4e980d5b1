"""Closed doors: discontinuities of colour and depth on both faces of a wall, and what else speaks for a leaf."""
