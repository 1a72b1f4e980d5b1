"""The built wheel and sdist hold what they should, and the command starts from the wheel alone."""

from __future__ import annotations

import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import scan2bim
from scan2bim.commands.failure import INTERRUPTED
from scan2bim.errors import InputError, PrecheckError, ResourceError, StageError, UsageError
from scan2bim.exporters import known_suffixes
from scan2bim.readers import SUFFIXES

ROOT = Path(scan2bim.__file__).parent.parent
pytestmark = pytest.mark.skipif(not (ROOT / "pyproject.toml").exists(), reason="not in a checkout")


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with wheel and sdist, built without the network."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-d", str(folder)], cwd=ROOT, check=True, capture_output=True
    )
    return folder


def wheel(folder: Path) -> Path:
    return next(folder.glob("*.whl"))


def sdist_names(folder: Path) -> set[str]:
    with tarfile.open(next(folder.glob("*.tar.gz"))) as archive:
        return {name.partition("/")[2] for name in archive.getnames()}


def test_the_wheel_installs_one_package_and_its_schemas(built: Path) -> None:
    with zipfile.ZipFile(wheel(built)) as archive:
        names = archive.namelist()
    assert {name.split("/")[0] for name in names} == {"scan2bim", f"scan2bim-{scan2bim.__version__}.dist-info"}
    assert any(name.startswith("scan2bim/schemas/") and name.endswith(".schema.json") for name in names)
    assert "scan2bim/py.typed" in names
    assert any(name.endswith("licenses/LICENSE") for name in names)


def test_the_wheel_holds_every_module_of_the_source(built: Path) -> None:
    package = ROOT / "scan2bim"
    expected = {str(path.relative_to(ROOT)) for path in package.rglob("*.py")}
    with zipfile.ZipFile(wheel(built)) as archive:
        assert expected <= set(archive.namelist())


def test_check_wheel_contents_finds_nothing_wrong(built: Path) -> None:
    result = subprocess.run(
        [sys.executable, "-m", "check_wheel_contents", "--toplevel", "scan2bim", str(wheel(built))],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stdout


def test_the_sdist_holds_package_tests_samples_and_docs(built: Path) -> None:
    names = sdist_names(built)
    assert {"pyproject.toml", "README.md", "LICENSE", "run", "constraints.txt", "scan2bim/cli.py"} <= names
    assert {"scan2bim/exporters/__init__.py", "tests/synthetic.py", "samples/flat/truth.json"} <= names
    assert "docs/architecture.md" in names
    assert not any(name.startswith(("out/", ".venv", ".tools")) for name in names)


def test_the_command_starts_from_the_unpacked_wheel(built: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(wheel(built)) as archive:
        archive.extractall(tmp_path)
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from scan2bim.cli import main; main(['--version'])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert result.stdout == f"scan2bim {scan2bim.__version__}\n", result.stderr


def test_the_constraints_name_versions_only() -> None:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    assert all(re.fullmatch(r"[a-z0-9][a-z0-9.-]*==[\w.]+( ; .+)?", line) for line in lines)


def test_the_setup_scripts_name_no_registry() -> None:
    for name in ("run", ".ci/run", "constraints.txt"):
        text = (ROOT / name).read_text(encoding="utf-8")
        assert "://" not in text, name
        assert "index-url" not in text, name


PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), ROOT / "samples" / "README.md"]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_pictures_of_the_documents_are_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target in [*re.findall(r"\]\(([^)#]+)\)", text), *re.findall(r'src="([^"]+)"', text)]:
        assert target.startswith("https://") or (page.parent / target).exists(), target


def test_pictures_in_the_readme_are_small() -> None:
    for name in ("flat_plan.png", "flat_view.png"):
        assert (ROOT / "docs" / "img" / name).stat().st_size < 200_000


def test_every_format_is_named_in_the_documents() -> None:
    text = (ROOT / "docs" / "formats.md").read_text(encoding="utf-8")
    for suffix in (*SUFFIXES, *known_suffixes()):
        assert re.search(rf"{re.escape(suffix)}\b", text), suffix


def test_the_readme_lists_the_exit_codes_of_the_errors() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    kinds = (UsageError, InputError, PrecheckError, StageError, ResourceError)
    for code in (0, 1, *(kind.exit_code for kind in kinds), INTERRUPTED):
        assert f"\n| {code} | " in text


def test_the_version_is_stated_once() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    assert f'version = "{scan2bim.__version__}"' in text or 'dynamic = ["version"]' in text
