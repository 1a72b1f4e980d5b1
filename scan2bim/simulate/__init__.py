"""Scenes with exact truth, and the laser scans that a scanner would take in them.

``scene`` describes a building in a few typed values, ``mesh`` turns it into plane patches, ``raycast`` finds what a
ray meets first, ``scanner`` makes a station's points of it, ``e57`` writes them and ``truth`` states what a reader of
the scans is to find.
"""
