"""``scan2bim info``: what is in the scans."""

from __future__ import annotations

import sys
from argparse import Namespace

from scan2bim.views import write_line


def run(options: Namespace) -> int:
    """Print what is in the scans."""
    from scan2bim.readers.info import describe, render

    write_line(sys.stdout, str((describe, render)))
    return 0
