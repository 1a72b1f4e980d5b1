"""How right a building model is: any tool's IFC against a truth, by the paper's measures and by detection.

``matching`` pairs openings, ``areas`` has the paper's measures, ``openings`` scores doors and windows, ``rooms`` walls,
spaces and storeys, ``faces`` and ``corners`` walls by their faces and boxes, ``reliability`` the confidences;
``report`` puts all into one value and into words.
"""
