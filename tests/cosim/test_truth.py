"""Whatever words a plant has for its attitude, the same truth follows."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.blocks.rotations import euler_from_quaternion, matrix_from_quaternion, over_rows, vertical_from_roll_pitch
from imufmu.cosim.truth import Told, derive, derived_names, knows_attitude

ROUNDING = 1e-14  # a few operations on numbers of size 1
SMALL = 1e-7  # rad; angles near +-90 deg of pitch lose half the digits


@pytest.fixture
def motion(rng: np.random.Generator) -> dict[str, np.ndarray]:
    """Random attitudes in all the words there are; roll, pitch, yaw by the project's own symbolic functions."""
    q = rng.standard_normal((200, 4))
    q /= np.linalg.norm(q, axis=1, keepdims=True) * np.sign(q[:, :1])
    angles = over_rows(euler_from_quaternion, q)
    matrix = over_rows(matrix_from_quaternion, q)
    vertical = over_rows(vertical_from_roll_pitch, angles[:, 0], angles[:, 1])
    return {"q": q, "angles": angles, "matrix": matrix, "vertical": vertical}


def told(quantity: str, values: np.ndarray, form: str = "", factor: float = 1.0) -> tuple[Told, dict[str, np.ndarray]]:
    """A quantity and the columns that tell it."""
    rows = values.reshape(len(values), int(np.prod(values.shape[1:])))
    names = tuple(f"plant.{quantity}{i}" for i in range(rows.shape[1]))
    return Told(quantity, names, (factor,) * len(names), form), dict(zip(names, rows.T / factor, strict=True))


def derived(*parts: tuple[Told, dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Signals by name without the component."""
    columns = {name: column for _, some in parts for name, column in some.items()}
    flat, units, notes = derive([one for one, _ in parts], columns)
    assert notes == []
    assert list(flat) == derived_names([one for one, _ in parts])
    assert set(units) == set(flat)
    signals: dict[str, list[np.ndarray]] = {}
    for name, column in flat.items():
        signals.setdefault(name.removeprefix("truth.").split("[")[0], []).append(column)
    return {name: np.column_stack(some) for name, some in signals.items()}


def turned(values: np.ndarray) -> np.ndarray:
    return values.reshape(-1, 3, 3).transpose(0, 2, 1)


WAYS = {
    "wxyz to-world": lambda m: [told("quaternion", m["q"], "wxyz to-world")],
    "wxyz to-body": lambda m: [told("quaternion", m["q"] * [1, -1, -1, -1], "wxyz to-body")],
    "xyzw to-world": lambda m: [told("quaternion", m["q"][:, [1, 2, 3, 0]], "xyzw to-world")],
    "xyzw to-body": lambda m: [told("quaternion", (m["q"] * [1, -1, -1, -1])[:, [1, 2, 3, 0]], "xyzw to-body")],
    "matrix to-world": lambda m: [told("matrix", m["matrix"], "to-world")],
    "matrix to-body": lambda m: [told("matrix", turned(m["matrix"]), "to-body")],
    "angles in deg": lambda m: [
        told(name, m["angles"][:, i], factor=np.pi / 180) for i, name in enumerate(("roll", "pitch", "yaw"))
    ],
}


@pytest.mark.parametrize("way", WAYS)
def test_every_way_to_tell_a_whole_attitude_gives_the_same_truth(way: str, motion: dict[str, np.ndarray]) -> None:
    found = derived(*WAYS[way](motion))
    np.testing.assert_allclose(found["vertical"], motion["vertical"], atol=ROUNDING)
    np.testing.assert_allclose(found["q_NS"], motion["q"], atol=SMALL)
    for i, name in enumerate(("roll", "pitch", "yaw")):
        error = np.angle(np.exp(1j * (found[name][:, 0] - motion["angles"][:, i])))
        np.testing.assert_allclose(error, 0, atol=SMALL)


def test_a_vertical_gives_roll_and_pitch_and_they_give_it(motion: dict[str, np.ndarray]) -> None:
    of_vertical = derived(told("vertical", 3.0 * motion["vertical"]))  # of any length
    of_angles = derived(told("roll", motion["angles"][:, 0]), told("pitch", motion["angles"][:, 1]))
    for found in (of_vertical, of_angles):
        assert set(found) == {"vertical", "roll", "pitch"}
        np.testing.assert_allclose(found["vertical"], motion["vertical"], atol=ROUNDING)
        np.testing.assert_allclose(found["pitch"][:, 0], motion["angles"][:, 1], atol=SMALL)


def test_what_needs_no_turning_is_passed_on(motion: dict[str, np.ndarray]) -> None:
    found = derived(
        told("vertical", motion["vertical"]), told("external_acceleration", motion["vertical"], factor=9.81)
    )
    np.testing.assert_allclose(found["external_acceleration"], motion["vertical"], atol=ROUNDING)


@pytest.mark.parametrize("some", [["roll"], ["pitch", "yaw"], ["position"], []])
def test_half_an_attitude_is_none(some: list[str]) -> None:
    assert not knows_attitude(some)
    assert derived_names([Told(name, ("plant.x",), (1.0,)) for name in some]) == []


def test_an_attitude_the_wrong_way_round_is_noticed_by_the_specific_force() -> None:
    """It points up in the mean, whatever the motion."""
    angle = 0.9 + 0.1 * np.sin(np.linspace(0, 20, 500))
    q = np.column_stack([np.cos(angle / 2), np.sin(angle / 2), 0 * angle, 0 * angle])
    force, columns = told("specific_force", 9.8 * np.column_stack([0 * angle, np.sin(angle), np.cos(angle)]))
    for form, notes in (("wxyz to-world", 0), ("wxyz to-body", 1), ("xyzw to-world", 1)):
        one, more = told("quaternion", q, form)
        said = derive([one, force], columns | more)[2]
        assert len(said) == notes
        assert all("the other way round, or in another order?" in note for note in said)


def test_a_plant_that_contradicts_itself_is_told(motion: dict[str, np.ndarray]) -> None:
    one, columns = told("matrix", motion["matrix"], "to-body")
    other, more = told("vertical", motion["vertical"])
    [note] = derive([one, other], columns | more)[2]
    assert "deg apart; the attitude counts" in note


def test_a_quaternion_that_is_no_unit_quaternion_is_told(motion: dict[str, np.ndarray]) -> None:
    one, columns = told("quaternion", 1.5 * motion["q"], "wxyz to-world")
    [note] = derive([one], columns)[2]
    assert "length differs from 1 by up to 0.5" in note


def test_a_run_without_rows_has_columns_without_rows() -> None:
    one, columns = told("vertical", np.empty((0, 3)))
    flat, units, notes = derive([one], columns)
    assert set(flat) == set(derived_names([one])) == set(units)
    assert notes == []
