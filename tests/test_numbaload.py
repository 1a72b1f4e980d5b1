"""Loading compiled functions from numba's cache without what only compiling needs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

KERNELS = """
import numba as nb

@nb.njit(cache=True)
def times(value, count):
    total = 0.0
    for _ in range(count):
        total += value
    return total

@nb.njit(cache=True)
def power(value, count):
    return 1.0 if count == 0 else value * power(value, count - 1)

@nb.njit
def both(value, count):
    return times(value, count) + power(value, count)
"""
RUN = """
import json, sys
from scan2bim.numbaload import load_without_compiler

load_without_compiler()
import llvmlite.binding as llvm

read, parse = [], llvm.parse_bitcode
llvm.parse_bitcode = lambda code, context=None: (read.append(len(code)), parse(code, context))[1]
import kernels

first = [kernels.times(2.0, 5), kernels.power(2.0, 5)]
loaded = sum(sum(one.stats.cache_hits.values()) for one in (kernels.times, kernels.power))
before = len(read)
print(json.dumps([*first, loaded, before, kernels.both(3.0, 2)]))
"""


def run_kernels(folder: Path) -> list[float]:
    """In a process of its own: what cached functions give, how many came from the cache, how much code was read for
    linking until then, and what a function gives that is compiled then and calls them.
    """
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache"), "PYTHONPATH": str(folder)}
    done = subprocess.run(
        [sys.executable, "-c", RUN], env=environment, cwd=folder, check=True, capture_output=True, text=True
    )
    return json.loads(done.stdout)


def test_cached_functions_are_loaded_without_code_to_link_until_something_is_compiled(tmp_path: Path) -> None:
    (tmp_path / "kernels.py").write_text(KERNELS, encoding="utf-8")
    first, again = run_kernels(tmp_path), run_kernels(tmp_path)
    assert first[:3] == [10.0, 32.0, 0]
    assert again == [10.0, 32.0, 2, 0, 15.0]
    assert first[4] == 15.0
