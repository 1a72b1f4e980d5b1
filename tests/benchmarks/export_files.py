"""What a model is exported to, and the outside judges that are called on it."""

from __future__ import annotations

import json
import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

from document import ROOT

from scan2bim.config import ExportSettings
from scan2bim.exporters import ifc, indoor_gml, model_json, navigation, usd
from scan2bim.model.elements import Building

VERSIONS = ("IFC4", "IFC4X3_ADD2", "IFC2X3")
USD = ("usda", "usdc", "usdz")
WEB_IFC = ROOT / "tests" / "benchmarks" / "web_ifc_volumes.mjs"


@dataclass(frozen=True, slots=True)
class Judges:
    """Programs that are not installed with the tests; None for one that is not at hand.

    rules: folder of buildingSMART's validation rules (ifc-gherkin-rules, with its data model in
    ``ifc_validation_models``), and the Python of an environment with its requirements. modules: the node_modules that
    web-ifc was installed to. assets: the command omni_asset_validate; simready: the command simready-validate.
    indoorgml: the schema indoorgmlcore.xsd, with what it includes beside it.
    """

    rules: Path | None = None
    python: Path | None = None
    modules: Path | None = None
    assets: Path | None = None
    simready: Path | None = None
    indoorgml: Path | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Exported:
    """A model and the folder with its files: ``IFC4.ifc``, ``house.usdc``, ``house.json``, ``house.nav.json``, ..."""

    building: Building
    folder: Path
    judges: Judges

    def ifc(self, version: str) -> Path:
        """The file of a version."""
        return self.folder / f"{version}.ifc"

    def usd(self, suffix: str = "usdc") -> Path:
        """The root layer in one of its forms."""
        return self.folder / f"house.{suffix}"


def write_all(building: Building, folder: Path) -> None:
    """All versions of IFC, all forms of USD, maps and graph, and the model."""
    folder.mkdir(parents=True)
    for version in VERSIONS:
        ifc.export(building, folder / f"{version}.ifc", ExportSettings(ifc_version=version))
    for suffix in USD:
        usd.export(building, folder / f"house.{suffix}")
    navigation.export(building, folder / "house.nav.json")
    indoor_gml.export(building, folder / "house.gml")
    model_json.export(building, folder / "house.json")


def run(command: list[str | Path], cwd: Path | None = None) -> str:
    """What a program says; its exit code counts for nothing, since judges fail where they find something."""
    environment = os.environ | {"PYTHONWARNINGS": "ignore", "PYTHONPATH": ""}
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False, env=environment)
    return done.stdout + done.stderr


def web_ifc_volumes(modules: Path, path: Path) -> dict[str, float]:
    """Net volumes of the walls by GlobalId, cubic metres, by web-ifc."""
    done = subprocess.run(["node", WEB_IFC, modules, path], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)
