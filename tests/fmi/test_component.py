"""Claims about what a Python FMU's component refuses that no host of today can hand to it."""

from __future__ import annotations

from typing import Any

import pytest

from imufmu.fmi.component import Component, Refusal
from imufmu.registry import BLOCKS

OTHER = "lee2012: the state is that of another FMU and was not set"
CHANGED = "lee2012: not a state of this block, or changed since it was saved"


def running() -> Component:
    component = Component(BLOCKS["lee2012"], warn=lambda message: None)
    component.setup_experiment(0.0)
    component.enter_initialization_mode()
    component.exit_initialization_mode()
    component.do_step(0.0, 0.05)
    return component


@pytest.mark.parametrize("state", [None, 5, ["block"], {}, {"block": "imu"}], ids=repr)
def test_a_state_that_is_none_of_ours_is_refused(state: Any) -> None:
    component = running()
    with pytest.raises(Refusal) as raised:
        component.set_state(state)
    assert str(raised.value) == OTHER


def test_a_state_whose_numbers_were_changed_is_refused_and_changes_nothing() -> None:
    component = running()
    before = component.get_state()
    changed = before | {"instance": before["instance"] | {"start_time": 1.0}, "phase": 8}
    with pytest.raises(Refusal) as raised:
        component.set_state(changed)
    assert str(raised.value) == CHANGED
    assert component.get_state() == before
