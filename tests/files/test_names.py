"""A name that nothing has is told with all names there are, and the one that was meant."""

from __future__ import annotations

from imufmu.files.names import no_such

KNOWN = ["lee2012", "leechoi2018", "plumb"]


def test_what_there_is_and_what_was_meant_are_told() -> None:
    assert no_such("block", "Lee2012", KNOWN) == (
        "no block is called 'Lee2012'; there is lee2012, leechoi2018, plumb; did you mean lee2012?"
    )


def test_nothing_is_suggested_for_a_name_like_no_other() -> None:
    assert no_such("block", "xyz", KNOWN, "or give a file") == (
        "no block is called 'xyz'; there is lee2012, leechoi2018, plumb, or give a file"
    )
