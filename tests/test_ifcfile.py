"""What is no IFC file that can be read is refused by name, with what came and what to do."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from scan2bim.errors import DamagedFileError, InputError
from scan2bim.ifcfile import open_ifc

WHOLE = (
    b"ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
    b"FILE_SCHEMA(('IFC4'));\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n"
)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty"),
        (b'{"a": 1}', "does not start as one.*Give a model as .ifc"),
        (WHOLE[:-30], "cut off.*Copy it again"),
        (b"ISO-10303-21;\nHEADER;\nrubbish\nEND-ISO-10303-21;", "cannot be read as IFC.*Export it again"),
    ],
)
def test_a_damaged_file_is_refused(content: bytes, said: str, tmp_path: Path) -> None:
    path = tmp_path / "bad.ifc"
    path.write_bytes(content)
    with pytest.raises(DamagedFileError, match=rf"(?s)bad\.ifc.*{said}"):
        open_ifc(path)


@pytest.mark.parametrize(("name", "said"), [("none.ifc", "no such"), (".", "is a folder"), ("none.ifczip", "no such")])
def test_what_is_no_file_is_refused(name: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=said):
        open_ifc(tmp_path / name)


def test_a_whole_file_is_opened(tmp_path: Path) -> None:
    (tmp_path / "good.ifc").write_bytes(WHOLE)
    assert open_ifc(tmp_path / "good.ifc").schema == "IFC4"


def test_loading_the_library_says_nothing_and_compiles_no_grammar() -> None:
    code = "import sys, scan2bim.exporters.ifc, scan2bim.ifcfile; assert not sys.modules.get('lark')"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (result.returncode, result.stdout, result.stderr) == (0, "", "")
