"""Columns of the table of exports: each judges one thing of a model's files and says it in a word."""

from __future__ import annotations

import base64
import json
import math
import re
import sys
import warnings
from collections.abc import Callable, Iterator
from itertools import chain
from pathlib import Path
from typing import Any

from document import ROOT
from export_files import USD, VERSIONS, Exported, run, web_ifc_volumes, write_all

NONE = "–"
"""Where the judge is not at hand."""

Column = Callable[[Exported], str]


def errors_of(version: str) -> Column:
    """A column: how many errors the library's validator finds in a version, schema and rules."""

    def column(files: Exported) -> str:
        import ifcopenshell
        import ifcopenshell.validate

        log = ifcopenshell.validate.json_logger()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ResourceWarning)
            ifcopenshell.validate.validate(ifcopenshell.open(str(files.ifc(version))), log, express_rules=True)
        return str(len(log.statements))

    return column


def contract(files: Exported) -> str:
    """Specifications of the delivery contract that IFC4 and IFC4X3_ADD2 do not meet."""
    import ifcopenshell

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from ifctester import ids

    failed: list[str] = []
    for version in ("IFC4", "IFC4X3_ADD2"):
        specifications = ids.open(str(ROOT / "scan2bim" / "schemas" / "delivery.ids"))
        specifications.validate(ifcopenshell.open(str(files.ifc(version))))
        failed += [s.name for s in specifications.specifications if s.status is False]
    return _counted(failed)


def rules_of(version: str) -> Column:
    """A column: errors and warnings of buildingSMART's rules, and the rules that their program could not run."""

    def column(files: Exported) -> str:
        judges = files.judges
        if judges.rules is None or judges.python is None:
            return NONE
        out = files.folder / f"rules-{version}.json"
        given = ["--define", f"input={files.ifc(version)}", "--define", "max_outcomes_per_rule=0"]
        command = [judges.python, "-m", "behave", "--tags=-disabled", *given, "-f", "outcome_embedding_json", "-o", out]
        run(command, judges.rules)
        features = json.loads(out.read_text(encoding="utf-8"))
        found = [feature["name"][:6] for feature in features for one in _outcomes(feature) if _is_fault(one)]
        crashed = [f["name"][:6] for f in features if f.get("status") == "failed" and f["name"][:6] not in found]
        return _counted(found) + "".join(f"; {name} cannot run" for name in crashed)

    return column


def _outcomes(feature: dict[str, Any]) -> Iterator[dict[str, Any]]:
    for element in feature.get("elements", ()):
        for part in element.get("validation_outcomes") or ():
            yield from json.loads(base64.b64decode(part["data"]))


def _is_fault(outcome: dict[str, Any]) -> bool:
    return str(outcome.get("severity")).upper().split(".")[-1] in ("ERROR", "WARNING", "3", "4")


def kernels(files: Exported) -> str:
    """Greatest difference of a wall's net volume between two kernels and what is stated."""
    import ifcopenshell
    import ifcopenshell.geom
    import ifcopenshell.util.shape

    file = ifcopenshell.open(str(files.ifc("IFC4")))
    settings = ifcopenshell.geom.settings()
    worst = 0.0
    for wall, stated in _walls(file):
        volumes = [stated]
        for kernel in ("opencascade", "cgal"):
            shape: Any = ifcopenshell.geom.create_shape(settings, wall, geometry_library=kernel)
            volumes.append(ifcopenshell.util.shape.get_volume(shape.geometry))
        worst = max(worst, (max(volumes) - min(volumes)) / max(*volumes, 1e-09))
    return f"{100 * worst:.3f} %"


def web_ifc(files: Exported) -> str:
    """Greatest difference of a wall's net volume between web-ifc and what is stated; a wall that it lacks is one."""
    import ifcopenshell

    if files.judges.modules is None:
        return NONE
    found = web_ifc_volumes(files.judges.modules, files.ifc("IFC4"))
    walls = _walls(ifcopenshell.open(str(files.ifc("IFC4"))))
    worst = max((abs(found.get(wall.GlobalId, 0.0) / stated - 1) for wall, stated in walls), default=0.0)
    return f"{100 * worst:.3f} %"


def _walls(file: Any) -> Iterator[tuple[Any, float]]:
    import ifcopenshell.util.element as util

    for wall in file.by_type("IfcWall"):
        volume: Any = util.get_pset(wall, "Qto_WallBaseQuantities", "NetVolume")
        yield wall, float(volume)


def check(files: Exported) -> str:
    """Findings of our own checker in all versions."""
    from scan2bim.check.run import check_file

    return _counted([f.check for version in VERSIONS for f in check_file(files.ifc(version)).findings])


def usd_validators(files: Exported) -> str:
    """Issues of all validators that come with USD, in each form, and in each variant of each door."""
    from pxr import Usd, UsdValidation  # pyright: ignore[reportAttributeAccessIssue]

    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    issues: list[str] = []
    for suffix in USD:
        stage = Usd.Stage.Open(str(files.usd(suffix)))
        stage.SetEditTarget(stage.GetSessionLayer())
        names = ("closed", "ajar", "open", "as_scanned") if suffix != "usdz" else ("",)
        for name in names:
            for path in [p.GetPath() for p in stage.Traverse() if "doorState" in p.GetVariantSets().GetNames()]:
                stage.GetPrimAtPath(path).GetVariantSets().GetVariantSet("doorState").SetVariantSelection(name)
            issues += [error.GetName() for error in context.Validate(stage)]
    return _counted(issues)


def asset_validator(files: Exported) -> str:
    """Issues of omniverse-asset-validator in each form, and in the doors' variants."""
    if files.judges.assets is None:
        return NONE
    told = [
        run([files.judges.assets, "--no-fix", "--variants", files.usd(suffix)])
        if suffix != "usdz"
        else run([files.judges.assets, "--no-fix", files.usd(suffix)])
        for suffix in USD
    ]
    bad = [line for text in told for line in text.splitlines() if re.search(r"\b(ERROR|FAILURE|WARNING)\b", line)]
    done = sum("No issues found" in text for text in told)
    return "0" if done == len(told) and not bad else f"{len(bad)} ({done} of {len(told)} without an issue)"


def simready(files: Exported) -> str:
    """Doors' assets that pass the profile, of all."""
    if files.judges.simready is None:
        return NONE
    assets = sorted(p.resolve() for p in files.folder.glob("house_usdc/assets/Door_*/usd/*.usdc"))
    if not assets:
        return "no asset"
    listed, out = files.folder / "assets.txt", files.folder / "simready.json"
    listed.write_text("\n".join(map(str, assets)), encoding="utf-8")
    run([files.judges.simready, "--profile", "Robotics-Prop", "--asset_list", listed, "--output", out])
    told = json.loads(out.read_text(encoding="utf-8"))
    passed = [path for path, result in told.items() if _passes(result)]
    return f"{len(passed)} of {len(assets)}"


def _passes(result: dict[str, Any]) -> bool:
    """No feature that the profile asks for is missed; those that it leaves open may be."""
    features = result.get("features_summary", {})
    return bool(features) and not any(feature.get("blocking_failure") for feature in features.values())


def doors(files: Exported) -> str:
    """Leaves that open to their limit when pushed, of all on hinges, in MuJoCo."""
    simulation = _simulation()(files.usd())
    opened = simulation.push_doors()
    full = [h for h in simulation.hinges if abs(opened[h.name] - max(h.high, -h.low)) < 1.5]
    return f"{len(full)} of {len(simulation.hinges)}"


def ways(files: Exported) -> str:
    """Ways from room to room that a body drives along through the open door, of all on the graph."""
    import numpy as np
    from simulation import Rooms

    rooms = Rooms(files.folder / "house.nav.json")
    edges = list(chain.from_iterable(rooms.ways(storey) for storey in rooms.storeys))
    passed = 0
    for edge in edges:
        path, door = rooms.path(edge), rooms.doors[edge["via"]]
        if path is not None:
            track = _simulation()(files.usd(), door["guid"], (*path[0], door["position"][2])).drive(path)
            passed += bool(math.hypot(*np.subtract(track[-1], path[-1])) < 0.05)
    return f"{passed} of {len(edges)}"


def _simulation() -> Any:
    tests = str(ROOT / "tests")
    if tests not in sys.path:
        sys.path.append(tests)
    from simulation import Simulation

    return Simulation


def indoor_gml(files: Exported) -> str:
    """Errors of the IndoorGML file by its schema."""
    if files.judges.indoorgml is None:
        return NONE
    import xmlschema

    schema = xmlschema.XMLSchema(str(files.judges.indoorgml), allow="local")
    return _counted([type(error).__name__ for error in schema.iter_errors(str(files.folder / "house.gml"))])


def rerun(files: Exported) -> str:
    """Whether a second run writes the same bytes: IFC, USD with its folders, maps, JSON."""
    again = files.folder / "again"
    write_all(files.building, again)
    second = {path.relative_to(again) for path in again.rglob("*") if path.is_file()}
    differing = [path for path in sorted(second) if (files.folder / path).read_bytes() != (again / path).read_bytes()]
    return f"{len(second)} files" if not differing else f"NO: {', '.join(map(str, differing))}"


def _counted(found: list[str]) -> str:
    kinds = sorted(set(found))
    return f"{len(found)}" + (f" ({', '.join(kinds)})" if kinds else "")


IFC_COLUMNS: dict[str, Column] = {
    **{f"{version} errors": errors_of(version) for version in VERSIONS},
    "IDS": contract,
    "rules, IFC4": rules_of("IFC4"),
    "rules, IFC4X3": rules_of("IFC4X3_ADD2"),
    "kernels": kernels,
    "web-ifc": web_ifc,
    "check": check,
}
USD_COLUMNS: dict[str, Column] = {
    "USD validators": usd_validators,
    "asset validator": asset_validator,
    "SimReady doors": simready,
    "doors open": doors,
    "ways": ways,
    "IndoorGML": indoor_gml,
    "rerun alike": rerun,
}
MUST_BE_NONE = ("IFC4 errors", "IFC4X3_ADD2 errors", "IFC2X3 errors", "IDS", "USD validators")
"""Columns that need no outside judge, and in which anything but 0 is a fault of ours."""


def clean(cells: dict[str, str]) -> bool:
    """Whether the columns in which nothing may be found are empty."""
    return all(cells.get(name, "0") == "0" for name in MUST_BE_NONE)


def path_of(text: str) -> Path:
    """A path from the command line as it is from anywhere."""
    return Path(text).absolute()
