"""Exporters: a file a format, found through the entry points group ``scan2bim.exporters``.

An exporter is a module with ``export(building, path) -> tuple[str, ...]``: it writes the one file ``path`` (and
where the format needs more, a folder beside it) from the model alone and gives in words what it left out. Where it has
a parameter ``settings`` it gets the export settings, where it has one ``points`` a function that reads the scans once
more (``model.points.PointSource``), or None where there are none. A module with ``ONLY_BY_NAME = True`` is left out of
a folder of all formats. The entry point's name is the file's suffix, without the
dot.
"""

from scan2bim.exporters.registry import Written, check_targets, known_suffixes, write_outputs

__all__ = ["Written", "check_targets", "known_suffixes", "write_outputs"]
