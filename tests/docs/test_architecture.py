"""The figure of the architecture shows the rooms there are, and is what its script draws."""

from __future__ import annotations

import runpy

from support.places import ROOT
from test_house import LEVEL, ORDER

SCRIPT = runpy.run_path(str(ROOT / "docs" / "architecture.py"))


def test_the_figure_shows_the_rooms_in_the_order_that_the_imports_keep():
    assert [name for name, _ in SCRIPT["ROOMS"]] == [", ".join(rooms) for rooms in ORDER]
    assert {room for room, *_ in SCRIPT["WAY"]} <= set(LEVEL)


def test_the_figure_is_what_its_script_draws():
    assert (ROOT / "docs" / "architecture.svg").read_text(encoding="utf-8") == SCRIPT["drawing"]()
