"""The work folder: results appear whole or not at all, two runs keep apart, and nothing strange is touched."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from scan2bim import workfolder
from scan2bim.errors import ResourceError, UsageError
from scan2bim.workfolder import digest, file_identity, folder_bytes, is_whole, open_work

KEY = "0123456789abcdef0123"


def write(text: str) -> Callable[[Path], None]:
    def body(folder: Path) -> None:
        (folder / "deep").mkdir()
        (folder / "deep" / "data.txt").write_text(text)

    return body


def test_a_result_is_found_after_it_was_made_and_its_files_are_there(tmp_path: Path) -> None:
    with open_work(tmp_path / "a" / "work") as work:
        assert work.find("read", KEY) is None
        made = work.make("read", KEY, write("hello"))
        assert made.made
        found = work.find("read", KEY)
        assert found is not None
        assert (found.folder, found.made) == (made.folder, False)
        assert (found.folder / "deep" / "data.txt").read_text() == "hello"
        assert work.find("read", KEY[::-1]) is None
        assert work.find("walls", KEY) is None


def test_what_is_half_made_when_a_run_ends_does_not_fill_the_disk(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), open_work(tmp_path / "work") as work:
        (work.temporary("read") / "points.bin").write_bytes(b"half")
        raise KeyboardInterrupt
    assert not (tmp_path / "work" / "tmp").exists()
    with open_work(tmp_path / "work") as work:
        assert work.temporary("read").is_dir()


def test_a_body_that_fails_leaves_nothing(tmp_path: Path) -> None:
    def body(folder: Path) -> None:
        (folder / "half.txt").write_text("half")
        raise KeyboardInterrupt

    with open_work(tmp_path / "work") as work:
        with pytest.raises(KeyboardInterrupt):
            work.make("read", KEY, body)
        assert work.find("read", KEY) is None
        assert list(work.tmp.iterdir()) == []


def test_a_result_with_a_lost_or_shortened_file_is_not_whole_and_is_made_again(tmp_path: Path) -> None:
    with open_work(tmp_path / "work") as work:
        folder = work.make("read", KEY, write("hello")).folder
        for spoil in (lambda path: path.write_text("hell"), lambda path: path.unlink()):
            spoil(folder / "deep" / "data.txt")
            assert not is_whole(folder)
            assert work.find("read", KEY) is None
            assert work.make("read", KEY, write("hello")).folder == folder
            assert is_whole(folder)


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"format": 99, "files": {}}', '{"format": 1}', '{"format": 1, "files": 3}']
)
def test_a_damaged_manifest_counts_as_no_result(tmp_path: Path, text: str) -> None:
    with open_work(tmp_path / "work") as work:
        folder = work.make("read", KEY, write("hello")).folder
        (folder / "manifest.json").write_text(text)
        assert work.find("read", KEY) is None


def test_what_a_killed_run_left_half_done_is_cleared(tmp_path: Path) -> None:
    with open_work(tmp_path / "work") as work:
        (work.temporary("read") / "half.bin").write_text("half")
    with open_work(tmp_path / "work") as work:
        assert list(work.tmp.iterdir()) == []


def test_prune_keeps_what_it_is_told_to_keep(tmp_path: Path) -> None:
    with open_work(tmp_path / "work") as work:
        for i in range(4):
            work.make("read", f"{i:020d}", write(str(i)))
        assert work.prune({f"{1:020d}"}) == 3
        assert [p.name for p in (work.stages / "read").iterdir()] == [f"{1:020d}"]
        assert list(work.tmp.iterdir()) == []


def test_two_runs_cannot_use_one_work_folder(tmp_path: Path) -> None:
    with (
        open_work(tmp_path / "work"),
        pytest.raises(UsageError, match=f"in use by process {os.getpid()} on .*--work"),
        open_work(tmp_path / "work"),
    ):
        pass
    with open_work(tmp_path / "work"):
        pass


def test_a_killed_process_leaves_no_lock(tmp_path: Path) -> None:
    code = (
        "import os, sys, signal, pathlib; from scan2bim.workfolder import open_work\n"
        "with open_work(pathlib.Path(sys.argv[1])): os.kill(os.getpid(), signal.SIGKILL)"
    )
    done = subprocess.run([sys.executable, "-c", code, str(tmp_path / "work")], check=False)
    assert done.returncode == -9
    with open_work(tmp_path / "work"):
        pass


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('{"scan2bim_work_folder": 2}', "made by a newer program"),
        ('{"scan2bim_work_folder": 0}', "made by another program"),
        ("nonsense", "made by another program"),
        ("{}", "made by another program"),
    ],
)
def test_a_work_folder_of_another_format_is_refused_and_left_alone(tmp_path: Path, text: str, words: str) -> None:
    root = tmp_path / "work"
    root.mkdir()
    (root / "format.json").write_text(text)
    with pytest.raises(UsageError, match=words), open_work(root):
        pass
    assert (root / "format.json").read_text() == text


def test_a_folder_with_other_files_is_refused_and_left_alone(tmp_path: Path) -> None:
    (tmp_path / "thesis.doc").write_text("years of work")
    (tmp_path / "tmp").mkdir()
    with pytest.raises(UsageError, match=r"holds thesis\.doc"), open_work(tmp_path):
        pass
    assert sorted(p.name for p in tmp_path.iterdir()) == ["thesis.doc", "tmp"]


def test_a_file_in_the_place_of_the_work_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "work").write_text("a file")
    with pytest.raises(UsageError, match="cannot be used as work folder"), open_work(tmp_path / "work"):
        pass


@pytest.mark.parametrize(
    ("number", "kind"), [(errno.EACCES, UsageError), (errno.EROFS, UsageError), (errno.ENOSPC, ResourceError)]
)
def test_a_folder_that_cannot_be_written_is_refused(
    tmp_path: Path, number: int, kind: type[Exception], monkeypatch: pytest.MonkeyPatch
) -> None:
    def mkdir(self: Path, *args: object, **kwargs: object) -> None:
        raise OSError(number, os.strerror(number), str(self))

    monkeypatch.setattr(Path, "mkdir", mkdir)
    with pytest.raises(kind, match=os.strerror(number)), open_work(tmp_path / "work"):
        pass


def test_identity_changes_with_content_name_and_size_and_not_with_place_or_time(tmp_path: Path) -> None:
    path = tmp_path / "a.e57"
    path.write_bytes(b"content")
    same = tmp_path / "sub" / "a.e57"
    same.parent.mkdir()
    same.write_bytes(b"content")
    os.utime(same, (1, 1))
    other = tmp_path / "b.e57"
    other.write_bytes(b"content")
    assert file_identity(path) == file_identity(same)
    assert file_identity(path) != file_identity(other)
    same.write_bytes(b"c0ntent")
    assert file_identity(path) != file_identity(same)


def test_a_big_file_is_known_by_its_ends_its_blocks_and_its_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(workfolder, "HASHED_WHOLE", 1000)
    path = tmp_path / "big.laz"
    path.write_bytes(bytes(3 * 2**20))
    os.utime(path, ns=(5, 5))
    first = file_identity(path)
    assert file_identity(path) == first
    for place in (0, 3 * 2**19, 3 * 2**20 - 1):
        data = bytearray(3 * 2**20)
        data[place] = 1
        path.write_bytes(bytes(data))
        os.utime(path, ns=(5, 5))
        assert file_identity(path) != first, f"byte {place} changed"
    path.write_bytes(bytes(3 * 2**20))
    os.utime(path, ns=(6, 6))
    assert file_identity(path) != first, "an edit anywhere changes the time"


def test_digest_keeps_its_parts_apart() -> None:
    assert digest("ab", "c") != digest("a", "bc")
    assert digest("a") != digest("a", "")
    assert len(digest()) == 20


def test_the_manifest_lists_the_files(tmp_path: Path) -> None:
    with open_work(tmp_path / "work") as work:
        folder = work.make("read", KEY, write("hello")).folder
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["files"] == {"deep/data.txt": 5}
    assert folder_bytes(folder) >= 5
