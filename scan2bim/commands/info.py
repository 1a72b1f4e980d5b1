"""``scan2bim info``: what is in the scans."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from pathlib import Path

from scan2bim.config import load_settings
from scan2bim.errors import InputError
from scan2bim.planning import look
from scan2bim.readers.info import as_json, render
from scan2bim.views import write_line


def run(options: Namespace) -> int:
    """Print what is in the scans. 3 where some file cannot be read, though the others are described."""
    frame = {key: value for key in ("unit", "up") if (value := getattr(options, key)) is not None}
    report, notes = look([Path(path) for path in options.paths], load_settings(None, {"frame": frame}))
    if options.json:
        found = json.loads(as_json(report)) | {"frame_notes": list(notes)}
        write_line(sys.stdout, json.dumps(found, indent=1, ensure_ascii=False))
    else:
        write_line(sys.stdout, "\n".join([render(report), *notes]))
    return InputError.exit_code if report.problems else 0
