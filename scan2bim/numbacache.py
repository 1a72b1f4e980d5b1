"""Where numba keeps compiled functions, and how they are loaded.

Without a place that it can write to, numba refuses to load them at all.
"""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import tempfile
from pathlib import Path

VARIABLE = "NUMBA_CACHE_DIR"


def numba_cache_folder() -> Path | None:
    """The folder that numba would write to, None where there is none."""
    if chosen := os.environ.get(VARIABLE):
        return Path(chosen) if _writable(Path(chosen)) else None
    beside = Path(__file__).parent / "__pycache__"
    return next((folder for folder in (beside, _of_user()) if _writable(folder)), None)


def ensure_numba_cache(fallback: Path | None = None) -> Path:
    """Where numba has no place of its own, point it to ``fallback``, or where that cannot be written to either, to a
    folder that lasts as long as this process. To be called before numba is imported.
    """
    found = numba_cache_folder()
    if found is not None:
        return found
    if fallback is None or not _writable(fallback):
        fallback = Path(tempfile.mkdtemp(prefix="scan2bim-"))
        atexit.register(shutil.rmtree, fallback, ignore_errors=True)
    os.environ[VARIABLE] = str(fallback)
    return fallback


def _of_user() -> Path:
    if sys.platform == "darwin":
        return Path("~/Library/Caches/numba").expanduser()
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", "~")).expanduser() / "numba" / "Cache"
    return Path(os.environ.get("XDG_CACHE_HOME", "~/.cache")).expanduser() / "numba"


def _writable(folder: Path) -> bool:
    """Whether the folder, or what would be its parents, can be written to."""
    place = folder.absolute()
    while not place.exists() and place != place.parent:
        place = place.parent
    return place.is_dir() and os.access(place, os.W_OK | os.X_OK)
