"""The semantic model of a building, its file, its identifiers and the questions asked of it."""
