"""Files are written whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from imufmu.files.atomic import WriteError, atomic_write


@pytest.mark.parametrize("interruption", [RuntimeError, KeyboardInterrupt])
def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, interruption: type[BaseException]
) -> None:
    target = tmp_path / "report.html"
    target.write_text("old")
    with pytest.raises(interruption), atomic_write(target) as temporary:
        temporary.write_text("half")
        raise interruption
    assert [path.name for path in tmp_path.iterdir()] == ["report.html"]
    assert target.read_text() == "old"


def test_a_written_file_has_the_usual_permissions_and_keeps_its_suffix(tmp_path: Path) -> None:
    with atomic_write(tmp_path / "plot.svg") as temporary:
        assert temporary.suffix == ".svg"
        temporary.write_text("new")
    (tmp_path / "plain").touch()
    assert (tmp_path / "plot.svg").read_text() == "new"
    assert (tmp_path / "plot.svg").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_a_symbolic_link_stays_one(tmp_path: Path) -> None:
    (tmp_path / "real.csv").write_text("old")
    (tmp_path / "link.csv").symlink_to(tmp_path / "real.csv")
    with atomic_write(tmp_path / "link.csv") as temporary:
        temporary.write_text("new")
    assert (tmp_path / "link.csv").is_symlink()
    assert (tmp_path / "real.csv").read_text() == "new"


def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    for path in (tmp_path / "missing" / "a.csv", tmp_path, Path(os.devnull), tmp_path / ("a" * 300)):
        with pytest.raises(WriteError, match="cannot write"), atomic_write(path):
            pass
    assert list(tmp_path.iterdir()) == []
