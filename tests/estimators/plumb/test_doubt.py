"""Claims about plumb where it must doubt itself: silence at the start, one wrong sample, rest that is not level."""

from __future__ import annotations

import math
from types import SimpleNamespace

import casadi as ca
import numpy as np
import pytest

from imufmu.blocks.vocabulary import Status
from imufmu.estimators.plumb import travel
from imufmu.estimators.plumb.covariance import PSI, V, measure
from support.plumb_motions import DEFAULTS, carried, consumer, moving, smooth, tilt_of

DT = 0.01
T = np.arange(4500) * DT
NOISE = DEFAULTS["s_v"] ** 2  # (m/s)^2/Hz, of a velocity of k_v


def test_a_silent_accelerometer_at_the_start_leaves_it_in_doubt() -> None:
    """A second without it: the velocity that is not read goes anywhere, and gravity with it."""
    motion = moving(60, 6, rate=1.0)
    readings = consumer(motion)
    readings["accel"][30:130] = math.nan
    _, doubts = tilt_of(motion, readings)
    _, believes = tilt_of(motion, readings, s_m=0.0)
    _, undisturbed = tilt_of(motion, consumer(motion))
    assert doubts["tilt_std"][135] > 3 * undisturbed["tilt_std"][135]
    assert doubts["tilt_std"][200] > 1.2 * believes["tilt_std"][200]


def test_after_a_brisk_turn_rest_that_is_not_level_mends_a_wrong_attitude_in_seconds() -> None:
    """One wrong sample of 8 deg; no vehicle that accelerates steadily has turned so fast a moment ago."""
    swing = 0.8 * np.sin(2 * np.pi * 0.8 * np.maximum(T - 10, 0)) * (smooth(T, 10, 1) - smooth(T, 19, 1))
    motion = carried(T, roll=swing)
    readings = consumer(motion)
    readings["gyro"][1950, 0] += np.radians(8) / DT
    error, result = tilt_of(motion, readings)
    assert error[1955] > 6
    assert error[2600:].max() < 1
    assert (result["status"][2000:2600].astype(int) & Status.LOST).any()


@pytest.mark.parametrize(("X", "density"), [(0.0, NOISE), (0.5, 4 * 0.3 * 0.5), (100.0, 10 * NOISE)])
def test_before_a_rest_a_velocity_that_was_there_is_believed_up_to_a_limit(X: float, density: float) -> None:
    """Equation (27), evaluated: the density of noise at least, ten times that at most."""
    H, speed = 0.05, 0.5  # with k_v = 0.5 m/s the density of noise is s_v^2
    before = X * (6.0 + H) / 6.0  # X fades within the block, as there is no velocity now
    x = SimpleNamespace(lasting=ca.DM.zeros(3), speed2=speed**2, swell=before, doubt=0, quiet=0, fresh=0)
    p = SimpleNamespace(**DEFAULTS)
    variance, _, states = travel.velocity(ca.DM.zeros(3), ca.SX.zeros(18, 18), 0, 0, x, H, p)
    assert float(states["swell"]) == pytest.approx(X)
    assert np.allclose(ca.evalf(variance).full().ravel(), density / H, rtol=1e-12)


@pytest.mark.parametrize(("speed", "levelled", "learns"), [(3.0, 0, 0), (3.0, 1, 1), (0.1, 0, 1)])
def test_a_velocity_that_may_be_a_wrong_attitude_teaches_nothing_about_the_gyroscope(
    speed: float, levelled: int, learns: int
) -> None:
    """A start in a bend: bias, scale and their covariance stay, until it is levelled or the velocity is small."""
    x = SimpleNamespace(lasting=ca.DM([speed, 0, 0]), speed2=0.25, swell=0, doubt=0, quiet=0, fresh=0)
    v_N = ca.DM([speed, 0, 0])
    P = ca.SX.eye(18) + 0.5 * ca.SX.ones(18, 18)
    variance, found, _ = travel.velocity(v_N, P, levelled, 0, x, 0.05, SimpleNamespace(**DEFAULTS))
    assert float(ca.evalf(ca.SX(found))) == learns
    error, after = measure(ca.SX.zeros(18), P, V, ca.vertsplit(-v_N), variance, found)
    error, after = (ca.evalf(part).full() for part in (error, after))
    assert np.all(error[PSI] != 0) and np.all(np.diag(after)[PSI] < 1.5)
    assert np.all((error[6:] != 0) == learns) and np.all((np.diag(after)[6:] < 1.5) == learns)
