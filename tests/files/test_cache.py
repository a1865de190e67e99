"""The cache gives back what was built: nothing half, nothing damaged, nothing of others."""

from __future__ import annotations

from pathlib import Path

import pytest

from imufmu.files.cache import cached


class Builder:
    """Writes the file, and counts how often."""

    def __init__(self, path: Path) -> None:
        self.path, self.times = path, 0

    def __call__(self) -> None:
        self.times += 1
        self.path.write_bytes(b"what was built")


@pytest.fixture
def builder(tmp_path: Path) -> Builder:
    made = Builder(tmp_path / "cache" / "a.fmu")
    assert cached(made.path, made) == made.path
    return made


def test_a_file_is_built_once(builder: Builder) -> None:
    cached(builder.path, builder)
    assert builder.times == 1


@pytest.mark.parametrize("content", [b"", b"what was buil", b"what was built, and more", b"what was BUILT", None])
def test_a_damaged_foreign_or_missing_file_is_built_again(content: bytes | None, builder: Builder) -> None:
    if content is None:
        builder.path.unlink()
    else:
        builder.path.write_bytes(content)
    cached(builder.path, builder)
    assert builder.times == 2
    assert builder.path.read_bytes() == b"what was built"
    cached(builder.path, builder)
    assert builder.times == 2


@pytest.mark.parametrize("digest", [None, "", "0" * 64, b"\xff\xfe"])
def test_a_file_without_its_digest_is_built_again(digest: str | bytes | None, builder: Builder) -> None:
    """As a cache of an older version, or one that was copied by halves."""
    place = builder.path.with_name("a.fmu.sha256")
    if digest is None:
        place.unlink()
    else:
        place.write_bytes(digest.encode() if isinstance(digest, str) else digest)
    cached(builder.path, builder)
    assert builder.times == 2
    cached(builder.path, builder)
    assert builder.times == 2


def test_a_build_that_fails_leaves_nothing_that_would_be_taken_for_built(tmp_path: Path) -> None:
    path = tmp_path / "a.fmu"

    def fails() -> None:
        path.write_bytes(b"half")
        raise RuntimeError

    with pytest.raises(RuntimeError):
        cached(path, fails)
    whole = Builder(path)
    cached(path, whole)
    assert whole.times == 1 and path.read_bytes() == b"what was built"
