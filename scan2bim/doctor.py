"""Whether the installation is complete: Python, packages, libraries, places to write, and the machine."""

from __future__ import annotations

import importlib
import os
import platform
import re
import shutil
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Literal

PACKAGE = "scan2bim"
LEAST_PYTHON = (3, 11)
LEAST_DISK = 2e9
"""Bytes: what a small building's work folder and outputs take."""
LEAST_MEMORY = 2e9
"""Bytes: what a conversion may take."""
MODULES = {
    "ifcopenshell": "ifcopenshell",
    "usd-core": "pxr",
    "opencv-python-headless": "cv2",
    "scikit-learn": "sklearn",
    "libusb-package": "libusb_package",
}
"""Module to import for a distribution, where it is not called the same."""
OPTIONAL = {"open3d": "only casting rays fast (simulated scans) needs it", "libusb-package": "only open3d needs it"}
"""Distributions without which ``convert`` works, with what they are for."""

State = Literal["ok", "remark", "fault"]


@dataclass(frozen=True, slots=True)
class Check:
    """A thing that was looked at. fault: ``convert`` does not work; remark: something else does not, or is tight."""

    name: str
    state: State
    text: str


def examine(folder: Path | None = None) -> tuple[Check, ...]:
    """Look at everything. ``folder`` is where outputs and work would go: the current one by default."""
    place = Path.cwd() if folder is None else folder
    return (
        check_python(),
        *check_packages(),
        check_exporters(),
        check_open3d(),
        check_numba_cache(),
        check_disk(place),
        check_machine(),
    )


def works(checks: Sequence[Check]) -> bool:
    """Whether ``convert`` works."""
    return all(check.state != "fault" for check in checks)


def check_python() -> Check:
    """The Python that runs this."""
    text = f"{platform.python_version()}, {sys.executable}"
    if sys.version_info < LEAST_PYTHON:
        return Check("Python", "fault", f"{text}: expected 3.11 or later")
    return Check("Python", "ok", text)


def check_packages() -> tuple[Check, ...]:
    """Each package that ours declares to need."""
    try:
        return tuple(check_package(need) for need in requirements())
    except metadata.PackageNotFoundError:
        return (Check(PACKAGE, "fault", "is not installed, only its folder is here. Install it: pip install ."),)


@dataclass(frozen=True, slots=True)
class Need:
    """A distribution that the package declares to need, with its least version ("" for any)."""

    name: str
    least: str
    text: str


def requirements() -> list[Need]:
    """What the installed package declares to need, extras left out."""
    needs: list[Need] = []
    for text in metadata.requires(PACKAGE) or ():
        required, _, condition = text.partition(";")
        match = re.match(r"([A-Za-z0-9._-]+)(?:\[[^]]*\])?\s*(?:>=\s*([0-9.]+))?", required.strip())
        if match and "extra" not in condition:
            needs.append(Need(match[1], match[2] or "", required.strip()))
    return needs


def check_package(need: Need) -> Check:
    """Whether a package is there, new enough, and can be imported."""
    bad: State = "remark" if need.name in OPTIONAL else "fault"
    purpose = f" ({OPTIONAL[need.name]})" if need.name in OPTIONAL else ""
    try:
        version = metadata.version(need.name)
    except metadata.PackageNotFoundError:
        return Check(need.name, bad, f"not installed{purpose}. Install it: pip install '{need.text}'")
    if _numbers(version) < _numbers(need.least):
        return Check(
            need.name, bad, f"{version}, expected {need.least} or later{purpose}: pip install -U '{need.text}'"
        )
    if need.name == "open3d":  # its own check loads it with the libraries that it needs
        return Check(need.name, "ok", version)
    problem = _import_problem(MODULES.get(need.name, need.name))
    if problem:
        return Check(need.name, bad, f"{version} cannot be imported{purpose}: {problem}")
    return Check(need.name, "ok", version)


def check_exporters() -> Check:
    """Whether the output formats are registered and can be loaded."""
    from scan2bim.errors import UsageError
    from scan2bim.exporters.registry import check_targets, known_suffixes

    suffixes = known_suffixes()
    try:
        for suffix in suffixes:
            check_targets([Path(f"check{suffix}")])
    except UsageError as error:
        state: State = "remark" if "cannot write" in str(error) else "fault"
        return Check("output formats", state, str(error))
    if not suffixes:
        return Check("output formats", "fault", f"none is registered. Install again: pip install {PACKAGE}")
    return Check("output formats", "ok", " ".join(suffixes))


def check_open3d() -> Check:
    """Whether rays can be cast."""
    from scan2bim.geometry.raycasting import MissingLibraryError, load_open3d

    try:
        load_open3d()
    except MissingLibraryError as error:
        return Check("ray casting", "remark", f"{error} (convert works without)")
    return Check("ray casting", "ok", "open3d loads")


def check_numba_cache() -> Check:
    """Whether compiled functions can be kept from run to run."""
    from scan2bim.numbacache import VARIABLE, numba_cache_folder

    folder = numba_cache_folder()
    if folder is None:
        text = f"no place to keep compiled functions: they go to each work folder. Set {VARIABLE} to a folder of yours."
        return Check("compiled functions", "remark", text)
    return Check("compiled functions", "ok", f"kept in {folder}")


def check_disk(place: Path) -> Check:
    """Whether the folder can be written to and has room."""
    from scan2bim.progress import size

    if not os.access(place, os.W_OK | os.X_OK):
        return Check("disk", "remark", f"{place} cannot be written to: name outputs (-o) elsewhere")
    free = shutil.disk_usage(place).free
    text = f"{size(free)} free in {place}"
    if free < LEAST_DISK:
        return Check("disk", "remark", f"{text}; a small building takes {size(LEAST_DISK)}, about 15 bytes a point")
    return Check("disk", "ok", text)


def check_machine() -> Check:
    """Cores and memory."""
    from scan2bim.estimate import cores
    from scan2bim.progress import size

    memory = _free_memory()
    text = f"{cores()} cores" + ("" if memory is None else f", {size(memory)} of memory available")
    if memory is not None and memory < LEAST_MEMORY:
        return Check("machine", "remark", f"{text}; a conversion takes up to {size(LEAST_MEMORY)}")
    return Check("machine", "ok", text)


def _free_memory() -> float | None:
    """Bytes that can be had without swapping, None where the system does not tell. A container's limit counts."""
    try:
        text = Path("/proc/meminfo").read_text(encoding="ascii")
        available = next(line for line in text.splitlines() if line.startswith("MemAvailable"))
    except (OSError, StopIteration):
        return None
    free = float(available.split()[1]) * 1024
    try:
        limit = Path("/sys/fs/cgroup/memory.max").read_text(encoding="ascii").strip()
        used = Path("/sys/fs/cgroup/memory.current").read_text(encoding="ascii").strip()
        return min(free, float(limit) - float(used)) if limit != "max" else free
    except (OSError, ValueError):
        return free


def _numbers(version: str) -> tuple[int, ...]:
    """The release numbers at the head of a version: 0.9.0.post1 is (0, 9, 0)."""
    match = re.match(r"[0-9]+(\.[0-9]+)*", version)
    return tuple(int(part) for part in match[0].split(".")) if match else ()


def _import_problem(module: str) -> str | None:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            importlib.import_module(module)
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    return None
