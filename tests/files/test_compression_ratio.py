"""An archive may unpack to much, or be small; to unpack to much from little is what bombs do."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from imufmu.files import archives
from imufmu.files.archives import LARGEST_RATIO, ArchiveError, unpack

UNSUSPICIOUS = 50_000  # bytes, instead of 64 MiB: the test is to be quick


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(archives, "UNSUSPICIOUS", UNSUSPICIOUS)


def archive(path: Path, *members: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for i, content in enumerate(members):
            target.writestr(f"{i}.bin", content)
    return path


def unpacks(path: Path) -> bool:
    folder = path.with_suffix("")
    folder.mkdir()
    try:
        unpack(path, folder)
    except ArchiveError as error:
        assert f"{path}: unpacks to " in str(error) and not list(folder.iterdir())
        return False
    return True


def test_zeros_are_refused_beyond_the_unsuspicious_size_only(tmp_path: Path) -> None:
    """Zeros pack some 500 to 1."""
    assert unpacks(archive(tmp_path / "small.zip", bytes(UNSUSPICIOUS)))
    assert not unpacks(archive(tmp_path / "large.zip", bytes(UNSUSPICIOUS + 1)))
    assert not unpacks(archive(tmp_path / "parts.zip", *[bytes(UNSUSPICIOUS // 4)] * 5))


def test_what_packs_less_than_the_ratio_is_accepted_at_any_size(tmp_path: Path) -> None:
    """Random bytes do not pack; as many zeros again as make the ratio a little less than the limit, or more."""
    noise = np.random.default_rng(4).bytes(10_000)
    assert unpacks(archive(tmp_path / "noise.zip", noise * 1, noise[::-1] * 1, bytes(UNSUSPICIOUS)))
    for share, accepted in ((0.8, True), (1.3, False)):
        path = archive(tmp_path / f"{share}.zip", noise, bytes(int(share * LARGEST_RATIO * 10_000)))
        assert unpacks(path) == accepted
