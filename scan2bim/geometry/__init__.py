"""Pure maths on arrays: meshes, rasters, ray casting."""
