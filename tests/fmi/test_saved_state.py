"""Claims about the bytes that hold the state of a Python FMU."""

from __future__ import annotations

import math

import pytest

from imufmu.fmi.saved_state import DamagedState, from_bytes, to_bytes

STATE = {"numbers": [0.1, 1e-300, -0.0, math.pi], "name": "lee2012"}


def test_a_state_returns_as_it_was() -> None:
    assert repr(from_bytes(to_bytes(STATE))) == repr(STATE)


@pytest.mark.parametrize("place", [0, 63, 64, 127, 128, -1], ids=["build", "", "hash", "", "content", ""])
def test_a_byte_of_another_build_of_the_hash_or_of_the_content_is_noticed(place: int) -> None:
    saved = bytearray(to_bytes(STATE))
    saved[place] ^= 1
    with pytest.raises(DamagedState, match="was changed, or is that of another FMU or another build"):
        from_bytes(bytes(saved))


@pytest.mark.parametrize("length", [0, 64, 128, 150])
def test_a_state_that_is_cut_is_noticed(length: int) -> None:
    with pytest.raises(DamagedState):
        from_bytes(to_bytes(STATE)[:length])
