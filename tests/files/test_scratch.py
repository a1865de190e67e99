"""Folders for the time of a run: plain, and gone, sooner or later."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from imufmu.files import scratch
from imufmu.files.scratch import ScratchError, scratch_folder
from support.optional import needs

HOLD = "from imufmu.files.scratch import new_scratch; held = new_scratch('run'); print(held[0], flush=True); input()"


@pytest.fixture
def base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def held(base: Path) -> tuple[subprocess.Popen[str], Path]:
    """A process that has a scratch folder, and the folder."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD], env={"TMPDIR": str(base)}, stdin=-1, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout
    return process, Path(process.stdout.readline().strip())


def test_a_folder_is_empty_our_own_and_gone_at_the_end(base: Path) -> None:
    with scratch_folder("run") as folder:
        assert folder.parent == base and list(folder.iterdir()) == []
        assert folder.stat().st_mode & 0o077 == 0
        (folder / "deep").mkdir()
    assert list(base.iterdir()) == []


@needs("POSIX")  # kills as is done there
def test_the_folder_of_a_killed_process_is_swept_and_that_of_a_living_one_left_alone(base: Path) -> None:
    (dead, lost), (alive, kept) = held(base), held(base)
    (lost / "binaries").mkdir()
    dead.send_signal(signal.SIGKILL)
    dead.communicate()
    with scratch_folder("run") as folder:
        assert {path for path in base.iterdir() if path.is_dir()} == {folder, kept}
    alive.communicate("\n")
    with scratch_folder("run"):
        assert not kept.exists()
    assert list(base.iterdir()) == []


def test_folders_of_others_are_not_touched(base: Path) -> None:
    (base / "imufmu_tests_1").mkdir()
    (base / "imufmu_notes.txt").touch()
    with scratch_folder("run"):
        pass
    assert sorted(path.name for path in base.iterdir()) == ["imufmu_notes.txt", "imufmu_tests_1"]


@pytest.mark.parametrize("name", ["Käse", "50%", "a#b", "it's", "a+b", "(x)"])
def test_a_folder_in_plain_letters_is_taken_where_the_users_own_is_not(
    base: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    odd, plain = base / name, base / "plain"
    odd.mkdir()
    plain.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(odd))
    monkeypatch.setattr(scratch, "_OTHERS", (str(plain),))
    with scratch_folder("run") as folder:
        assert folder.parent == plain


def test_one_error_names_the_folder_and_the_remedy_where_there_is_none(
    base: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    odd = base / "Käse"
    odd.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(odd))
    monkeypatch.setattr(scratch, "_OTHERS", (str(base / "missing"),))
    with pytest.raises(ScratchError, match=rf"{re.escape(str(odd))}.*TMPDIR"), scratch_folder("run"):
        pass
