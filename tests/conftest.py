"""Stands here so that tests in all folders can import the helpers of this one: ``from buildings import building``."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

import scan2bim

FLAT = Path(scan2bim.__file__).parent.parent / "samples" / "flat"
FLAT_OUTPUTS = (
    "flat.ifc",
    "flat.usdz",
    "flat.usdc",
    "flat.nav.json",
    "flat.dxf",
    "flat.pdf",
    "flat.glb",
    "flat.xlsx",
    "flat.csv",
    "flat.laz",
    "flat.json",
    "flat.svg",
    "flat.png",
    "flat.view.png",
)


@pytest.fixture(scope="session")
def converted_flat(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The folder with the outputs of converting the sample flat, and what the command said on stdout."""
    folder = tmp_path_factory.mktemp("flat")
    outputs = [argument for name in FLAT_OUTPUTS for argument in ("-o", str(folder / name))]
    arguments = ["convert", str(FLAT), *outputs]
    code = f"import sys; from scan2bim.cli import main; sys.exit(main({arguments!r}))"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return folder, result.stdout
