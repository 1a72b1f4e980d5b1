"""``scan2bim schema``: the JSON Schema of the model's files."""

from __future__ import annotations

import sys
from argparse import Namespace

from scan2bim.model.io import schema_text


def run(options: Namespace) -> int:
    """Print the schema."""
    sys.stdout.write(schema_text())
    return 0
