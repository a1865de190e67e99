"""A machine may lack what is optional: every test that needs it asks in support/optional.py and is skipped there."""

from __future__ import annotations

import re

import pytest

from support.places import ROOT

OWN_WAYS = r"skipif|importorskip|shutil\.which|(?<!def )find_spec\(|IMUFMU_RECORDINGS|[\"/]shared[\"/]"


def test_nothing_optional_is_asked_for_anywhere_else() -> None:
    allowed = {"tests/support/optional.py", "tests/test_optional.py"}
    found = [
        f"{path}, line {number}: {line.strip()}"
        for path in (str(p.relative_to(ROOT)) for p in sorted((ROOT / "tests").rglob("*.py")))
        if path not in allowed
        for number, line in enumerate((ROOT / path).read_text(encoding="utf-8").splitlines(), 1)
        if re.search(OWN_WAYS, line)
    ]
    assert not found, "\n".join(found)


def test_what_reads_recordings_is_marked_so_that_it_can_be_run_without_them(
    request: pytest.FixtureRequest, broad: object
) -> None:
    assert request.node.get_closest_marker("recordings")
