"""A full disk costs one line with the file's name, and leaves no half-written file and the old one as it was."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from imufmu import Result, locate, pack
from imufmu.compiled.compilers import BuildError
from imufmu.files.atomic import WriteError
from imufmu.files.cache import cached
from imufmu.files.csv_table import write_csv
from imufmu.fmi.build import build_fmu
from imufmu.papers.validate import Verdict
from imufmu.papers.verdicts import write_json, write_page
from imufmu.pictures.figures import save
from imufmu.pictures.movies import write_movie
from imufmu.reports.junit import write_junit
from support.optional import needs

pytestmark = needs("POSIX")  # a limit of the size of files stands for a full disk


@contextmanager
def room_for(size: int) -> Iterator[None]:
    """No file may grow beyond this many bytes."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


N = 2000
COLUMNS = {f"a.v{i}": np.arange(float(N)) for i in range(10)}
RESULT = Result("system", np.arange(float(N)), COLUMNS, dict.fromkeys(COLUMNS, "m"))
VERDICTS = [Verdict("lee2012", "title", "reference" * 1000, 1.0, None, "broke off " * 1000)]


def figure() -> Figure:
    drawn = Figure()
    drawn.subplots().plot(np.random.default_rng(1).normal(size=100))
    return drawn


WRITERS: dict[str, Callable[[Path], object]] = {
    "a.csv": lambda path: write_csv(path, COLUMNS),
    "a.h5": RESULT.to_hdf5,
    "a.xml": lambda path: write_junit(path, "validate", [v.suite() for v in VERDICTS]),
    "a.json": lambda path: write_json(path, VERDICTS, False),
    "a.html": lambda path: write_page(path, VERDICTS, False),
    "a.png": lambda path: save(figure(), path),
    "a.svg": lambda path: save(figure(), path),
    "a.gif": lambda path: write_movie(path, figure(), range(3), 20),
    "a.ssp": lambda path: pack(locate("pendulum_lee2012"), path),
}


@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("size", [0, 100, 3000])
def test_a_writer_names_the_file_and_leaves_the_old_one(name: str, size: int, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text("old")
    write = WRITERS[name]
    write(tmp_path / f"first_{name}")  # what it loads and builds the first time is not what is tested
    (tmp_path / f"first_{name}").unlink()
    with pytest.raises(WriteError) as caught, room_for(size):
        write(path)
    assert str(caught.value) == f"{path}: cannot write: File too large"
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == [name]


def test_an_fmu_that_cannot_be_built_leaves_nothing(tmp_path: Path) -> None:
    build_fmu("lee2012", tmp_path / "first")
    for size in (0, 1000, 100_000):
        with pytest.raises(BuildError, match=r"cannot write.*File too large") as caught, room_for(size):
            build_fmu("lee2012", tmp_path / "second")
        assert "\n" not in str(caught.value)
        assert list((tmp_path / "second").iterdir()) == []


def test_what_cannot_be_cached_is_built_the_next_time(tmp_path: Path) -> None:
    path = tmp_path / "cache" / "a.csv"
    with pytest.raises(WriteError, match=r"a\.csv: cannot write"), room_for(100):
        cached(path, lambda: write_csv(path, COLUMNS))
    assert not path.exists()
    assert cached(path, lambda: write_csv(path, COLUMNS)).stat().st_size > 100


def test_hdf5_writes_as_before_where_there_is_room(tmp_path: Path) -> None:
    with room_for(10 * N * 8 * 2):
        RESULT.to_hdf5(tmp_path / "a.h5")
    assert (tmp_path / "a.h5").stat().st_size > 10 * N * 8
