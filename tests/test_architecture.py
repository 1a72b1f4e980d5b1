"""The layout of docs/architecture.md: who may import whom, no circles, light start, small files and functions."""

from __future__ import annotations

import ast
import subprocess
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import scan2bim

PACKAGE = Path(scan2bim.__file__).parent

# Top-level modules that are no package of their own, by the layer that they belong to.
LAYER_OF_MODULE = {
    "cli": "cli",
    "commands": "cli",
    "doctor": "cli",
    "errors": "errors",
    "config": "config",
    **dict.fromkeys(
        (
            "progress",
            "workfolder",
            "guard",
            "logs",
            "numbacache",
            "numbaload",
            "absent",
            "allocator",
            "parallel",
            "ifcfile",
        ),
        "support",
    ),
    **dict.fromkeys(
        (
            "pipeline",
            "stages",
            "reading",
            "planning",
            "estimate",
            "views",
            "scans",
            "scan_points",
            "scan_voxels",
            "assemble",
            "assemble_linings",
            "assemble_members",
            "assemble_plates",
            "verification",
            "surveying",
        ),
        "pipeline",
    ),
}
BASE = {"errors", "config", "support"}
MAY_IMPORT = {
    "errors": set[str](),
    "config": {"errors"},
    "support": {"errors", "config"},
    "geometry": {"errors", "support"},
    "model": {"geometry", "errors"},
    "cloud": BASE | {"model", "geometry"},
    "readers": BASE | {"cloud", "model", "geometry"},
    "structure": BASE | {"cloud", "model", "geometry"},
    "openings": BASE | {"cloud", "model", "geometry", "structure"},
    "verify": BASE | {"cloud", "model", "geometry"},
    "coverage": BASE | {"cloud", "model", "geometry"},
    "exporters": {"errors", "config", "support", "model", "geometry"},
    "report": {"errors", "support", "model", "geometry"},
    "check": {"errors", "support"},
    "truth": {"errors", "support", "geometry"},
    "simulate": {"errors", "cloud", "model", "geometry", "truth"},
    "evaluate": {"errors", "truth"},
    "pipeline": BASE
    | {"readers", "structure", "openings", "verify", "coverage", "exporters", "report", "cloud", "model", "geometry"},
    "cli": BASE
    | {
        "pipeline",
        "check",
        "readers",
        "exporters",
        "report",
        "verify",
        "simulate",
        "evaluate",
        "truth",
        "cloud",
        "model",
        "geometry",
    },
}
HEAVY = [
    "numpy",
    "open3d",
    "sklearn",
    "ifcopenshell",
    "pxr",
    "pydantic",
    "scipy",
    "numba",
    "pye57",
    "laspy",
    "cv2",
    "shapely",
    "rich",
]
OPEN3D_HOME = "geometry/raycasting.py"


@cache
def sources() -> list[Path]:
    return sorted(PACKAGE.rglob("*.py"))


def module_name(path: Path) -> str:
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"


@cache
def module_names() -> frozenset[str]:
    return frozenset(module_name(path) for path in sources())


def import_nodes(node: ast.AST) -> list[ast.Import | ast.ImportFrom]:
    """All imports below ``node``, those for type checkers alone left out."""
    if isinstance(node, ast.Import | ast.ImportFrom):
        return [node]
    return [
        found for child in ast.iter_child_nodes(node) if not is_type_checking(child) for found in import_nodes(child)
    ]


@cache
def imported(path: Path) -> frozenset[str]:
    """Names of the modules that a file imports, relative imports resolved."""
    names: set[str] = set()
    package = module_name(path) if path.name == "__init__.py" else module_name(path).rpartition(".")[0]
    for node in import_nodes(tree(path)):
        if isinstance(node, ast.Import):
            names.update(alias.name for alias in node.names)
            continue
        base = package.rsplit(".", node.level - 1)[0] + "." if node.level else ""
        origin = (base + (node.module or "")).rstrip(".")
        inner = {f"{origin}.{alias.name}" for alias in node.names} & module_names()
        names.update(inner or {origin})
    return frozenset(names)


def layer(module: str) -> str | None:
    """The layer of a module of the package; None for the package's own face, ``scan2bim``."""
    parts = module.split(".")
    return None if len(parts) == 1 else LAYER_OF_MODULE.get(parts[1], parts[1])


def inner_imports(path: Path) -> set[str]:
    return {name for name in imported(path) if name == "scan2bim" or name.startswith("scan2bim.")}


def test_every_module_belongs_to_a_layer() -> None:
    assert {layer(module_name(path)) for path in sources()} - {None} <= set(MAY_IMPORT)


def test_imports_follow_the_arrows() -> None:
    wrong = [
        f"{module_name(path)} -> {name}"
        for path in sources()
        for name in sorted(inner_imports(path))
        if (own := layer(module_name(path)))
        and (other := layer(name))
        and other != own
        and other not in MAY_IMPORT[own]
    ]
    assert wrong == []


def test_openings_know_the_values_that_structure_gives_and_none_of_its_steps() -> None:
    known = {
        name
        for path in sources()
        if layer(module_name(path)) == "openings"
        for name in inner_imports(path)
        if layer(name) == "structure"
    }
    assert known <= {"scan2bim.structure.shapes"}


def test_no_module_imports_itself_by_a_detour() -> None:
    graph = {module_name(path): inner_imports(path) - {"scan2bim", module_name(path)} for path in sources()}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"circle: {' -> '.join(error.args[1])}")


def test_open3d_is_imported_in_one_place_only() -> None:
    found = {
        str(path.relative_to(PACKAGE))
        for path in sources()
        for name in imported(path)
        if name.split(".")[0] == "open3d"
    }
    assert found <= {OPEN3D_HOME}


@pytest.mark.parametrize("statement", ["import scan2bim", "import scan2bim.cli", "import scan2bim.errors"])
def test_the_face_of_the_package_imports_nothing_heavy(statement: str) -> None:
    code = f"{statement}\nimport sys\nprint(*sorted(set(sys.modules) & set({HEAVY!r})))"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split() == []


def test_help_imports_nothing_heavy() -> None:
    code = (
        "import sys\nfrom scan2bim.cli import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        f"print('loaded:', *sorted(set(sys.modules) & set({HEAVY!r})))"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.splitlines()[-1].strip() == "loaded:"


def test_no_file_is_longer_than_400_lines() -> None:
    lengths = {str(path.relative_to(PACKAGE)): len(path.read_text(encoding="utf-8").splitlines()) for path in sources()}
    assert {name: n for name, n in lengths.items() if n > 400} == {}


def test_no_function_is_longer_than_60_lines() -> None:
    functions = [
        (path, node)
        for path in sources()
        for node in ast.walk(tree(path))
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)
    ]
    long = [f"{p.name}: {f.name}" for p, f in functions if (f.end_lineno or f.lineno) - f.lineno + 1 > 60]
    assert long == []


def test_the_links_at_the_root_lead_into_the_package() -> None:
    root = PACKAGE.parent
    if not (root / "exporters").exists():
        pytest.skip("not in a checkout")
    for name in ("exporters", "schemas"):
        link = root / name
        assert link.is_symlink()
        assert link.readlink() == Path("scan2bim") / name
