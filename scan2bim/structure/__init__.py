"""Structure of the building: frame, storeys, wall faces, spaces, walls."""
