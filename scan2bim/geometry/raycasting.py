"""Loading open3d, which casts rays. Its wheel needs libraries of the system that a fresh machine lacks.

Only what casts rays (simulating) calls this; reading and converting work without open3d.
"""

from __future__ import annotations

import ctypes
import importlib
import sys
import warnings
from typing import Any

from scan2bim.errors import Scan2BimError

LIBRARIES = {
    "libusb-1.0.so.0": "libusb-1.0-0",
    "libGL.so.1": "libgl1",
    "libEGL.so.1": "libegl1",
    "libX11.so.6": "libx11-6",
    "libudev.so.1": "libudev1",
    "libidn2.so.0": "libidn2-0",
    "libgomp.so.1": "libgomp1",
}
"""Libraries that open3d's wheels for Linux link to, each with the Debian and Ubuntu package that brings it."""


class MissingLibraryError(Scan2BimError, ImportError):
    """open3d cannot be loaded; the message says what to install."""


def load_open3d() -> Any:
    """The module open3d. Raises MissingLibraryError that says what to install.

    libusb is loaded from the Python package libusb-package where the system has none: that needs no root.
    """
    if sys.platform == "linux":
        provide_libusb()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return importlib.import_module("open3d")
    except (ImportError, OSError) as error:
        raise MissingLibraryError(_advice(error)) from error


def provide_libusb() -> bool:
    """Make libusb known to the loader, from the system or from libusb-package. Gives whether it is."""
    if _loads("libusb-1.0.so.0"):
        return True
    try:
        package = importlib.import_module("libusb_package")
        ctypes.CDLL(str(package.get_library_path()), ctypes.RTLD_GLOBAL)
    except (ImportError, OSError):
        return False
    return True


def missing_libraries() -> tuple[str, ...]:
    """Those of ``LIBRARIES`` that cannot be loaded, none on other systems than Linux."""
    if sys.platform != "linux":
        return ()
    has_usb = provide_libusb()
    return tuple(name for name in LIBRARIES if not _loads(name) and not (has_usb and name.startswith("libusb")))


def install_line(missing: tuple[str, ...]) -> str:
    """The command that installs the missing libraries on Debian and Ubuntu."""
    return f"sudo apt-get install {' '.join(LIBRARIES[name] for name in missing)}"


def _advice(error: Exception) -> str:
    missing = tuple(name for name in missing_libraries() if name != "libgomp.so.1" or "libgomp" in str(error))
    if isinstance(error, ModuleNotFoundError) and error.name == "open3d":
        return "Rays are cast with the package open3d, which is not installed. Install it: pip install open3d"
    if missing:
        return (
            f"Rays are cast with open3d, which needs {', '.join(missing)}. "
            f"On Debian or Ubuntu: {install_line(missing)}. Elsewhere install the packages that hold these libraries."
        )
    return f"Rays are cast with open3d, which cannot be loaded ({error}). Install it again: pip install open3d"


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True
