"""A saved state comes back whole or not at all."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest

from imufmu.blocks.instance import ContinuousInstance, Instance, SampledInstance, StateError, instantiate
from support.toys import LAZY, MIRROR, OSCILLATOR


def stepped(block: Any) -> Instance:
    """After some steps, with a missing input at hand: NaN is part of the state."""
    instance: SampledInstance | ContinuousInstance = instantiate(block)
    instance.initialise(2.0)
    for k in range(5):
        instance.u[:] = 0.3 * k
        instance.do_step(2.0 + 0.013 * k, 0.013)
    instance.u[0] = math.nan
    return instance


@pytest.mark.parametrize("block", [MIRROR, OSCILLATOR], ids=lambda block: block.name)
def test_a_state_with_any_number_changed_is_refused_and_changes_nothing(block: Any) -> None:
    instance = stepped(block)
    saved = instance.get_state()
    present = json.dumps(saved)
    for name, value in saved.items():
        places = range(len(value)) if isinstance(value, list) else [None]
        for place in places:
            changed = json.loads(present)
            if place is not None:
                changed[name][place] = 1.0 if changed[name][place] != 1.0 else 2.0
            else:
                changed[name] = value + "0" if isinstance(value, str) else value + 1
            with pytest.raises(StateError, match=f"^{block.name}: not a state of this block, or changed"):
                instance.set_state(changed)
    assert json.dumps(instance.get_state()) == present
    instance.set_state(json.loads(present))
    assert json.dumps(instance.get_state()) == present


def test_what_is_no_state_of_the_block_is_refused() -> None:
    instance, other = stepped(MIRROR), stepped(LAZY)
    saved = instance.get_state()
    shorter = saved | {"x": saved["x"][:-1]}
    worded = saved | {"x": ["a", *saved["x"][1:]]}
    for state in ({}, {"digest": saved["digest"]}, other.get_state(), shorter, worded, saved | {"values": None}):
        with pytest.raises(StateError):
            instance.set_state(state)
    assert len(other.x) == len(instance.x)  # nothing but the name tells them apart


def test_the_sign_of_zero_is_part_of_the_state() -> None:
    instance = stepped(MIRROR)
    instance.x[0] = 0.0
    saved = instance.get_state()
    with pytest.raises(StateError):
        instance.set_state(saved | {"x": [-0.0, *saved["x"][1:]]})
