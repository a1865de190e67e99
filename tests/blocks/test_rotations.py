"""Claims about rotations, against scipy and closed forms."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks import rotations as r

ROUNDING = 1e-14  # some twenty operations on numbers up to 1
HALF_PI = math.pi / 2


def attitudes() -> Rotation:
    """Identity, 1e-8 rad about each axis, half turns, pitch +-90 deg (upside down too), and seeded random ones."""
    small = Rotation.from_rotvec(1e-8 * np.eye(3))
    half_turns = Rotation.from_rotvec(math.pi * np.eye(3))
    steep = Rotation.from_euler("ZYX", [[0.3, s * HALF_PI, x] for s in (1, -1) for x in (0.0, 1.2, math.pi)])
    return Rotation.concatenate(
        [Rotation.identity(1), small, half_turns, steep, Rotation.random(200, random_state=np.random.default_rng(1))]
    )


def scalar_first(rotation: Rotation) -> np.ndarray:
    return np.roll(rotation.as_quat(), 1, axis=1)


def value_and_slope(f: Callable[..., Any], *at: Any) -> tuple[np.ndarray, np.ndarray]:
    """f and its Jacobian with respect to all arguments."""
    symbols = [ca.SX.sym(f"a{i}", np.size(a)) for i, a in enumerate(at)]
    result = f(*symbols)
    flat = ca.vertcat(*result) if isinstance(result, tuple) else ca.vec(result)
    function = ca.Function("f", symbols, [flat, ca.jacobian(flat, ca.vertcat(*symbols))])
    value, slope = function(*at)
    return np.array(value).ravel(), np.array(slope)


ZERO, UP, DOWN = np.zeros(3), np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, -1.0])
FORWARD = np.array([1.0, 0.0, 0.0])
STEEP = scalar_first(Rotation.from_euler("ZYX", [[0.3, HALF_PI, 0.0], [0.3, -HALF_PI, 0.0]]))

SINGULAR_POINTS = [
    (r.norm, (ZERO,)),
    (r.unit, (ZERO,)),
    (r.root, (0.0,)),
    (r.angle_of, (0.0, 0.0)),
    (r.roll_pitch, (FORWARD,)),
    (r.roll_pitch, (-FORWARD,)),
    (r.roll_pitch, (ZERO,)),
    (r.euler_from_quaternion, (STEEP[0],)),
    (r.euler_from_quaternion, (STEEP[1],)),
    (r.euler_from_quaternion, (np.sqrt([0.5, 0, 0.5, 0]),)),  # pitch 90 deg as exactly as it gets
    (r.quaternion_from_rotation_vector, (ZERO,)),
    (r.angle_between, (UP, UP)),
    (r.angle_between, (UP, DOWN)),
    (r.angle_between, (ZERO, ZERO)),
]


@pytest.mark.parametrize(("f", "at"), SINGULAR_POINTS, ids=lambda x: getattr(x, "__name__", None))
def test_values_and_derivatives_are_finite_at_singular_points(f: Callable[..., Any], at: tuple[Any, ...]) -> None:
    value, slope = value_and_slope(f, *at)
    assert np.isfinite(value).all()
    assert np.isfinite(slope).all()


@pytest.mark.parametrize("scale", [1e-91, 1e-30, 1e-8, 1.0, 1e8, 1e100])
def test_guards_are_exact_away_from_zero(scale: float, rng: np.random.Generator) -> None:
    """Bit for bit: the guard is lost in rounding."""
    # At 1e-91 the square of the guard, 1e-200, is below half an ulp of |v|^2.
    v = scale * rng.uniform(0.5, 1, (100, 3)) * rng.choice([-1, 1], (100, 3))
    length = np.sqrt(v[:, 0] ** 2 + v[:, 1] ** 2 + v[:, 2] ** 2)
    assert np.array_equal(r.over_rows(r.norm, v)[:, 0], length)
    assert np.array_equal(r.over_rows(r.unit, v), v / length[:, None])
    angle = r.over_rows(r.angle_of, v[:, 0], v[:, 1])[:, 0]
    assert np.array_equal(angle, [math.atan2(y, x) for y, x in v[:, :2]])
    x = np.abs(v[:, 0]) if scale > 1e-80 else np.full(100, 1e-80)  # root guards its argument, not its result
    assert np.array_equal(r.over_rows(r.root, x)[:, 0], np.sqrt(x))


def test_guarded_functions_have_the_documented_value_at_their_singularity() -> None:
    assert value_and_slope(r.norm, ZERO)[0] == r.TINY
    assert np.array_equal(value_and_slope(r.unit, ZERO)[0], ZERO)
    assert value_and_slope(r.angle_of, 0.0, 0.0)[0] == 0.0
    assert value_and_slope(r.root, -1e-18)[0] == pytest.approx(0.0, abs=1e-99)  # TINY
    assert np.array_equal(value_and_slope(r.quaternion_from_rotation_vector, ZERO)[0], [1, 0, 0, 0])
    # TINY instead of 0, and pi less TINY: the cross product has no direction there.
    assert value_and_slope(r.angle_between, UP, UP)[0] == pytest.approx(0.0, abs=1e-99)
    assert value_and_slope(r.angle_between, UP, DOWN)[0] == math.pi


def test_derivatives_at_zero_are_the_limits() -> None:
    """A turn by a small vector v is (1, v/2) to first order; a length has no slope at zero, and is given zero."""
    assert np.array_equal(
        value_and_slope(r.quaternion_from_rotation_vector, ZERO)[1], np.vstack([ZERO, 0.5 * np.eye(3)])
    )
    assert np.array_equal(value_and_slope(r.norm, ZERO)[1], [ZERO])


def test_skew_is_the_cross_product(rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, 50, 3))
    assert np.allclose(r.over_rows(lambda a, b: r.skew(a) @ b, a, b), np.cross(a, b), rtol=0, atol=ROUNDING)


def test_roll_pitch_inverts_the_vertical(rng: np.random.Generator) -> None:
    roll, pitch = rng.uniform(-math.pi, math.pi, 200), rng.uniform(-HALF_PI, HALF_PI, 200)
    roll[:4], pitch[:4] = [0, math.pi, 0, 1e-8], [0, 0, 1e-8, 0]
    found = r.over_rows(r.roll_pitch, r.over_rows(r.vertical_from_roll_pitch, roll, pitch))
    # Close to pitch +-90 deg the roll is known to rounding / cos(pitch).
    assert np.all(np.abs(found[:, 0] - roll) <= ROUNDING / np.cos(pitch))
    assert np.allclose(found[:, 1], pitch, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("sign", [1, -1])
def test_roll_is_zero_where_pitch_is_90_degrees(sign: int) -> None:
    roll_pitch, _ = value_and_slope(r.roll_pitch, -sign * FORWARD)
    assert np.array_equal(roll_pitch, [0.0, sign * HALF_PI])


def test_euler_angles_make_the_matrix_of_scipy_and_its_last_row_is_the_vertical(rng: np.random.Generator) -> None:
    yaw, pitch, roll = rng.uniform(-math.pi, math.pi, (3, 200))
    expected = Rotation.from_euler("ZYX", np.column_stack([yaw, pitch, roll])).as_matrix()
    matrix = r.over_rows(r.matrix_from_euler, roll, pitch, yaw)
    assert np.allclose(matrix, expected.reshape(-1, 9), rtol=0, atol=ROUNDING)
    vertical = r.over_rows(r.vertical_from_roll_pitch, roll, pitch)
    assert np.allclose(vertical, expected[:, 2], rtol=0, atol=ROUNDING)


def test_euler_angles_of_a_quaternion_make_the_same_attitude() -> None:
    """Everywhere, also at pitch +-90 deg, where the angles themselves are not unique."""
    roll, pitch, yaw = r.over_rows(r.euler_from_quaternion, scalar_first(attitudes())).T
    back = Rotation.from_euler("ZYX", np.column_stack([yaw, pitch, roll]))
    assert np.allclose(back.as_matrix(), attitudes().as_matrix(), rtol=0, atol=ROUNDING)
    assert np.all(np.abs(pitch) <= HALF_PI)
    assert np.all(np.abs(np.concatenate([roll, yaw])) <= math.pi)


def test_rotation_vectors_make_the_quaternion_of_scipy(rng: np.random.Generator) -> None:
    direction = rng.normal(size=(100, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    v = direction * rng.choice([0.0, 1e-150, 1e-8, 1.0, math.pi, 6.0], 100)[:, None]
    q = r.over_rows(r.quaternion_from_rotation_vector, v)
    expected = scalar_first(Rotation.from_rotvec(v))
    same_sign = np.sign(np.sum(q * expected, axis=1))[:, None]
    assert np.allclose(q * same_sign, expected, rtol=0, atol=ROUNDING)


def test_quaternions_compose_and_rotate_as_in_scipy(rng: np.random.Generator) -> None:
    p, q = attitudes(), attitudes()[rng.permutation(len(attitudes()))]
    v = rng.normal(size=(len(p), 3))
    pq = r.over_rows(r.multiply, scalar_first(p), scalar_first(q))
    assert np.allclose(r.over_rows(r.matrix_from_quaternion, pq), (p * q).as_matrix().reshape(-1, 9), 0, ROUNDING)
    assert np.allclose(r.over_rows(r.rotate, scalar_first(p), v), p.apply(v), rtol=0, atol=ROUNDING)
    assert np.allclose(r.over_rows(r.rotate_back, scalar_first(p), v), p.inv().apply(v), rtol=0, atol=ROUNDING)
    identity = r.over_rows(lambda a: r.multiply(a, r.conjugate(a)), scalar_first(p))
    assert np.allclose(identity, [1, 0, 0, 0], rtol=0, atol=ROUNDING)


@pytest.mark.parametrize("angle", [1e-12, 1e-8, 1.0, HALF_PI, math.pi - 1e-8])
def test_angle_between_is_accurate_near_zero_and_pi(angle: float, rng: np.random.Generator) -> None:
    a = rng.normal(size=(100, 3))
    axis = np.cross(a, rng.normal(size=(100, 3)))
    axis /= np.linalg.norm(axis, axis=1)[:, None]
    b = 7 * Rotation.from_rotvec(angle * axis).apply(a)
    # An arccosine would be off by 1e-8 at both ends.
    assert np.allclose(r.over_rows(r.angle_between, a, b)[:, 0], angle, rtol=0, atol=ROUNDING)


def test_over_rows_evaluates_each_row_on_its_own(rng: np.random.Generator) -> None:
    v = rng.normal(size=(5, 3))
    assert np.array_equal(r.over_rows(r.unit, v)[2], r.over_rows(r.unit, v[2:3])[0])


def test_over_rows_flattens_matrices_row_by_row_and_stacks_tuples() -> None:
    rows = r.over_rows(r.skew, np.array([[1.0, 2.0, 3.0]]))
    assert np.array_equal(rows, [[0, -3, 2, 3, 0, -1, -2, 1, 0]])
    assert r.over_rows(r.roll_pitch, np.eye(3)).shape == (3, 2)
    assert r.over_rows(r.vertical_from_roll_pitch, np.zeros(4), np.zeros(4)).shape == (4, 3)
