"""What a building has, in plain values: the truth beside simulated scans, and what any IFC model says.

``values`` holds them, ``io`` their JSON form, ``ifc`` reads them out of an IFC file.
"""
