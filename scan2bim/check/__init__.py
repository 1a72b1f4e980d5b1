"""Integrity of any IFC file: what no validator catches, since the schema allows it and a building does not."""
