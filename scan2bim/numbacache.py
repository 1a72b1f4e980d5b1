"""Where numba keeps compiled functions, and how they are loaded.

Without a place that it can write to, numba refuses to load them at all. And before it loads the first one it sets up
its whole compiler, which takes half a second of CPU in each process, whether anything has to be compiled or not.
"""

from __future__ import annotations

import contextlib
import importlib
import inspect
import os
import sys
from functools import cache
from pathlib import Path
from typing import Any

from scan2bim.absent import absent

VARIABLE = "NUMBA_CACHE_DIR"


def numba_cache_folder() -> Path | None:
    """The folder that numba would write to, None where there is none."""
    if chosen := os.environ.get(VARIABLE):
        return Path(chosen) if _writable(Path(chosen)) else None
    beside = Path(__file__).parent / "__pycache__"
    return next((folder for folder in (beside, _of_user()) if _writable(folder)), None)


def ensure_numba_cache(fallback: Path) -> Path:
    """Point numba to ``fallback`` where it has no place of its own. To be called before numba is imported."""
    found = numba_cache_folder()
    if found is None:
        os.environ[VARIABLE] = str(fallback)
    return found or fallback


@cache
def load_without_compiler() -> None:
    """Let numba load functions from its cache without setting up its compiler; that waits for the first that is not
    there. Does nothing where numba works otherwise than it is known to.
    """
    kept: Any = getattr(importlib.import_module("numba.core.caching"), "Cache", None)
    runtime: Any = getattr(importlib.import_module("numba.core.runtime"), "rtsys", None)
    load, usual = getattr(kept, "_load_overload", None), getattr(kept, "load_overload", None)
    known = ["self", "sig", "target_context"]
    if runtime is None or load is None or usual is None:
        return
    if any(list(inspect.signature(f).parameters) != known for f in (load, usual)):
        return

    def load_overload(self: Any, sig: Any, target_context: Any) -> Any:
        with contextlib.suppress(Exception):  # whatever it is, the usual way does without
            runtime.initialize(target_context)
            with absent("scipy.linalg"):  # for products of matrices in compiled functions, of which there are none
                found = load(self, sig, target_context)
            if found is not None:
                return found
        return usual(self, sig, target_context)

    kept.load_overload = load_overload


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
