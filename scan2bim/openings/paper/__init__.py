"""The founding paper's recognition of closed doors (section V), step by step and by its own names.

Quintana, Prieto, Adan and Bosche: Door Detection in 3D Colored Laser Scans for Autonomous Indoor Navigation.
"""
