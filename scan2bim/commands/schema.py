"""``scan2bim schema``: the JSON Schema of the model's files or of a verification's report."""

from __future__ import annotations

import sys
from argparse import Namespace


def run(options: Namespace) -> int:
    """Print the schema."""
    if options.of == "report":
        from scan2bim.verify.result import report_schema

        sys.stdout.write(report_schema())
    else:
        from scan2bim.model.io import schema_text

        sys.stdout.write(schema_text())
    return 0
