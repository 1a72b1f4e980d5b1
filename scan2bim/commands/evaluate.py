"""``scan2bim evaluate``: how right a building model is."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path

from scan2bim.evaluate.report import evaluate, in_words
from scan2bim.views import write_line


def run(options: Namespace) -> int:
    """Print the scores of an IFC model against a truth."""
    found = evaluate(Path(options.model), Path(options.truth))
    write_line(sys.stdout, found.model_dump_json(indent=1) if options.json else in_words(found))
    return 0
