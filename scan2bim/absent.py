"""Importing a library without what it loads beside to no use of ours."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Generator
from typing import Any


@contextlib.contextmanager
def absent(name: str) -> Generator[None]:
    """Inside, a module that is not loaded yet seems not to be installed."""
    modules: dict[str, Any] = sys.modules  # None stands for a module that cannot be imported
    if name in modules:
        yield
        return
    modules[name] = None
    try:
        yield
    finally:
        del modules[name]
