"""Claims about the cascaded filter of Zihajehzadeh et al. 2014."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from imufmu.blocks.vocabulary import MID_EUROPE, Status
from imufmu.compiled.running import run
from imufmu.estimators import lee2012
from imufmu.estimators.zihajehzadeh2014 import BLOCK
from support import golden, motions
from support.motions import FIELD_N, G, angle
from support.nine_axis import DIP, FIELD, NORM, disturbed, estimate, inputs_of, noisy_mag, yaw_error

OF_TILT = ("roll", "pitch", "vertical", "external_acceleration", "tilt_std", "P1")


@pytest.fixture(scope="module")
def waved() -> motions.Motion:
    """20 s of waving and shaking, as noisy as the filter assumes; the field disturbed for 3 s in a coarse way."""
    rng = np.random.default_rng(7)
    motion = motions.motion(rng, 2000, acceleration=0.5).noisy(rng)
    motion.mag[:] = noisy_mag(disturbed(motion, slice(800, 1100), [15.0, -4.0, 8.0]))
    return motion


# Against the reference vectors


@pytest.mark.parametrize("given_start", [False, True], ids=["own_start", "given_start"])
@pytest.mark.parametrize("name", golden.names("zihajehzadeh"))
def test_every_column_equals_the_reference_vectors(name: str, given_start: bool) -> None:
    case = golden.load(name)
    same = (
        "c_a",
        "sigma_g2",
        "sigma_a2",
        "sigma_m2",
        "g",
        "eps_m",
        "eps_dip",
        "h",
        "m_ref",
        "normalise1",
        "normalise2",
    )
    parameters = {key: case.parameters[key] for key in same} | {"sample_period": case.parameters["dt"]}
    inputs = {n: golden.columns(case.inputs, c, 3) for n, c in (("gyro", "gyro"), ("accel", "acc"), ("mag", "mag"))}
    x1, x2, P1, P2 = (golden.columns(case.outputs, c, n) for c, n in (("x1", 3), ("x2", 3), ("P1", 9), ("P2", 9)))
    start = {"x1": x1[0], "x2": x2[0], "P1": P1[0], "P2": P2[0], "dip0": case.outputs["dip"][0]}
    result = run(BLOCK, inputs, parameters, initial_state=start if given_start else None)
    assert np.array_equal(result["mag_ok"], case.outputs["mag_ok"])
    golden.assert_equal(result["vertical"], x1, "x1")
    golden.assert_equal(result["x2"], x2, "x2")
    golden.assert_equal(result["P1"].reshape(-1, 9), P1, "P1")
    golden.assert_equal(result["P2"].reshape(-1, 9), P2, "P2")
    for column in ("roll", "pitch", "yaw", "alpha_m", "dip"):
        golden.assert_equal(result[column], case.outputs[column], column)


# Against the paper, written down a second time in NumPy


def row_1(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Row 1 of (2)."""
    s, c = np.sin, np.cos
    return np.array(
        [
            c(yaw) * c(pitch),
            c(yaw) * s(pitch) * s(roll) - s(yaw) * c(roll),
            c(yaw) * s(pitch) * c(roll) + s(yaw) * s(roll),
        ]
    )


def reference(
    motion: motions.Motion,
    *,
    c_a: float = 0.3,
    sigma_g2: float = 1e-4,
    sigma_a2: float = 1e-4,
    sigma_m2: float = 1e-4,
    eps_m: float = 0.5,
    eps_dip: float = math.radians(2),
    eps_yaw: float = math.inf,
    yaw_drift: float = 0.005,
    dip_of_m_ref: bool = False,
    normalise1: bool = True,
    normalise2: bool = True,
    gyro_index: str = "prev",
    P10: float = 1.0,
    P20: float = 1.0,
    infinity: float = math.inf,
) -> dict[str, np.ndarray]:
    """(5) to (28) of the paper, with the readings that make them computable. infinity: the variance of (26)."""
    gyro, accel, mag, dt = motion.gyro, motion.accel, motion.mag, motion.dt
    identity = np.eye(3)

    def skew(w: np.ndarray) -> np.ndarray:
        return np.cross(identity, w)  # the matrix of w x

    def predicted(x: np.ndarray, P: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        A = identity - dt * skew(w)
        return A @ x, A @ P @ A.T - dt**2 * sigma_g2 * skew(x) @ skew(x)

    def updated(x: np.ndarray, P: np.ndarray, z: np.ndarray, C: float, R: float) -> tuple[np.ndarray, np.ndarray]:
        if math.isinf(R):
            return x, P
        K = C * P @ np.linalg.inv(C * P * C + R * identity)
        return x + K @ (z - C * x), (identity - C * K) @ P

    def tilt_of(x1: np.ndarray) -> tuple[float, float]:
        return math.atan2(x1[1], x1[2]), math.atan2(-x1[0], math.hypot(x1[1], x1[2]))

    def yaw_of(x: np.ndarray, roll: float, pitch: float) -> float:
        return math.atan2(-math.cos(roll) * x[1] + math.sin(roll) * x[2], x[0] / math.cos(pitch))

    def measured(y_M: np.ndarray, roll: float, pitch: float) -> float:
        tilt_y_M = Rotation.from_euler("YX", [pitch, roll]).apply(y_M)
        difference = math.atan2(FIELD_N[1], FIELD_N[0]) - math.atan2(tilt_y_M[1], tilt_y_M[0])
        return math.remainder(difference, 2 * math.pi)

    x1 = accel[0] / np.linalg.norm(accel[0])
    a, P1, P2 = accel[0] - G * x1, P10 * identity, P20 * identity
    alpha_m = measured(mag[0], *tilt_of(x1))
    x2, dip0 = row_1(*tilt_of(x1), alpha_m), math.pi / 2 + DIP if dip_of_m_ref else angle(x1, mag[:1])[0]
    slack, mag_ok = 0.0, True
    rows = []
    for t in range(len(accel)):
        if t > 0:
            w = {"prev": gyro[t - 1], "curr": gyro[t], "mid": (gyro[t - 1] + gyro[t]) / 2}[gyro_index]
            x1, P1 = predicted(x1, P1, w)
            x1, P1 = updated(x1, P1, accel[t] - c_a * a, G, c_a**2 * (a @ a) / 3 + sigma_a2)
            x1 = x1 / np.linalg.norm(x1) if normalise1 else x1
            a = accel[t] - G * x1
            x2, P2 = predicted(x2, P2, w)
            alpha_m = measured(mag[t], *tilt_of(x1))
            innovation = math.remainder(alpha_m - yaw_of(x2, *tilt_of(x1)), 2 * math.pi)
            mag_ok = (
                abs(np.linalg.norm(mag[t]) - NORM) < eps_m
                and abs(angle(x1, mag[t : t + 1])[0] - dip0) < eps_dip
                and abs(innovation) <= eps_yaw + slack
            )
            slack = max(slack - yaw_drift * dt, 0.0) if mag_ok else slack + yaw_drift * dt
            x2, P2 = updated(x2, P2, row_1(*tilt_of(x1), alpha_m), 1.0, sigma_m2 if mag_ok else infinity)
            x2 = x2 / np.linalg.norm(x2) if normalise2 else x2
        tilt = tilt_of(x1)
        rows.append((*tilt, yaw_of(x2, *tilt), alpha_m, x1 / np.linalg.norm(x1), a, x2, P1, P2, float(mag_ok)))
    names = ("roll", "pitch", "yaw", "alpha_m", "vertical", "external_acceleration", "x2", "P1", "P2", "mag_ok")
    return dict(zip(names, (np.array(column) for column in zip(*rows, strict=True)), strict=True))


# Reading of the reference, and the parameters of the block that select it.
OPTIONS: list[tuple[dict[str, Any], dict[str, Any]]] = [
    ({}, {}),
    ({"gyro_index": "curr"}, {"gyro_index": 1}),
    ({"gyro_index": "mid"}, {"gyro_index": 2}),
    *(
        (option, option)
        for option in (
            {"normalise1": False},
            {"normalise2": False},
            {"c_a": 0.0, "sigma_g2": 1e-5, "sigma_a2": 1e-3, "sigma_m2": 1e-2},
            {"P10": 10.0, "P20": 0.1},
            {"eps_m": 0.1, "eps_dip": 0.01},
            {"eps_yaw": 0.03, "yaw_drift": 0.02},
            {"dip_of_m_ref": True},
        )
    ),
]


@pytest.mark.parametrize(("reading", "parameters"), OPTIONS, ids=lambda o: " ".join(f"{k}={v}" for k, v in o.items()))
def test_every_reading_equals_the_paper_written_down_again(
    reading: dict[str, Any], parameters: dict[str, Any], waved: motions.Motion
) -> None:
    result, expected = estimate(waved, **parameters), reference(waved, **reading)
    assert np.array_equal(result["mag_ok"], expected["mag_ok"])
    for name, values in expected.items():
        golden.assert_equal(result[name], values, name)


def test_the_readings_differ_on_this_motion(waved: motions.Motion) -> None:
    """Else the comparison above shows little."""
    default = estimate(waved)
    assert 0 < np.mean(default["mag_ok"] == 0) < 0.5
    assert np.abs(default["pitch"]).max() < 1.5  # the reference divides by its cosine
    for _, parameters in OPTIONS[1:]:
        assert np.abs(estimate(waved, **parameters)["x2"] - default["x2"]).max() > 1e-7, parameters


def test_a_rejected_sample_is_the_limit_of_an_infinite_variance(waved: motions.Motion) -> None:
    result, limit = estimate(waved), reference(waved, infinity=1e30)
    for name in ("x2", "P2", "yaw"):
        golden.assert_equal(result[name], limit[name], name)


# The cascade


def test_the_tilt_is_that_of_lee2012(waved: motions.Motion) -> None:
    result = estimate(waved)
    alone = run(lee2012.BLOCK, {"gyro": waved.gyro, "accel": waved.accel}, {"mode": 1, "c_a": 0.3})
    for name in ("roll", "pitch", "vertical", "external_acceleration"):
        # The output normalises x1 once more, for where normalise1 is off.
        assert np.allclose(result[name], alone[name], rtol=0, atol=1e-14), name
    assert np.array_equal(result["P1"], alone["P"])


def test_the_magnetometer_never_touches_the_tilt(waved: motions.Motion) -> None:
    """Bit for bit: disturbed, missing, without direction, absurd, and starting late."""
    expected, nan = estimate(waved), math.nan
    absurd = np.random.default_rng(3).choice([0.0, 1e6, -1e6, nan, math.inf, 5e-324], waved.mag.shape)
    late = np.where(np.arange(2000)[:, None] < 300, nan, waved.mag)
    for mag in (
        disturbed(waved, slice(0, 2000), [30, 0, 0]),
        np.full_like(waved.mag, nan),
        np.zeros_like(waved.mag),
        absurd,
        late,
    ):
        result = estimate(waved, mag)
        for name in OF_TILT:
            assert np.array_equal(result[name], expected[name]), name
        assert all(np.isfinite(values).all() for values in result.values.values())


# Heading


@pytest.mark.parametrize("declination", [0.0, 0.3])
def test_rest_gives_the_right_attitude_at_any_attitude(declination: float) -> None:
    """At pitch +-90 deg too, where yaw and roll are one; the declination of the field is in m_ref."""
    upright = Rotation.from_euler("ZYX", [[0.4, math.pi / 2, 0], [-2, -math.pi / 2, 0.7], [1, 1.5705, 0], [3, 0, 3]])
    field = Rotation.from_euler("Z", -declination).apply(FIELD_N)
    for attitude in [*upright, *Rotation.random(20, random_state=np.random.default_rng(4))]:
        motion = motions.rest(attitude, 100)
        result = estimate(motion, np.tile(attitude.inv().apply(field), (100, 1)), m_ref=field)
        error = Rotation.from_quat(np.roll(result["q_NS"], -1, axis=1)) * motion.R_NS.inv()
        assert error.magnitude().max() < 1e-9  # perfect readings: rounding, magnified up to 1e4 times at pitch 90 deg


@pytest.mark.parametrize(("course", "expected"), [((0, 1), 0), ((1, 0), 90), ((0, -1), 180), ((-1, 0), 270)])
def test_heading_is_the_compass_course_of_the_x_axis(course: tuple[int, int], expected: float) -> None:
    """x axis to the North, East, South, West."""
    east, north = course
    result = estimate(motions.rest(Rotation.from_euler("Z", math.atan2(north, east)), 3))
    difference = np.degrees(result["heading"]) - expected
    assert np.abs((difference + 180) % 360 - 180).max() < 1e-9
    assert np.all((result["heading"] >= 0) & (result["heading"] <= 2 * math.pi))


@pytest.mark.parametrize("axis", [[0, 0, 1], [0, 1, 0], [0.6, 0, 0.8]])
def test_a_steady_turn_is_followed_in_all_three_angles(axis: list[float]) -> None:
    """1 rad/s for 10 s, a whole turn, over pitch +-90 deg for the y axis: one sample of lag, at most two."""
    motion = motions.turn(Rotation.from_euler("Z", 0.5), np.array(axis, float), 1000)
    result = estimate(motion)
    error = Rotation.from_quat(np.roll(result["q_NS"], -1, axis=1)) * motion.R_NS.inv()
    assert error.magnitude().max() < 2 * motion.dt


def test_the_unit_of_the_field_does_not_matter(waved: motions.Motion) -> None:
    in_uT = estimate(waved)
    normalised = estimate(waved, waved.mag / NORM, m_ref=FIELD_N / NORM, h=1.0, eps_m=0.5 / NORM)
    assert np.array_equal(normalised["mag_ok"], in_uT["mag_ok"])
    assert np.allclose(normalised["q_NS"], in_uT["q_NS"], rtol=0, atol=1e-12)  # rounding


def test_the_defaults_fit_the_field_of_the_plants() -> None:
    """No parameter but the defaults: rest in the plants' mid-European field gives the right yaw, nothing rejected."""
    attitude = Rotation.from_euler("ZYX", [0.8, 0.2, -0.3])
    motion = motions.rest(attitude, 200)
    result = run(BLOCK, inputs_of(motion, mag=noisy_mag(np.tile(attitude.inv().apply(MID_EUROPE), (200, 1)))))
    assert not result["status"].any()
    assert np.abs(result["yaw"] - 0.8).max() < math.radians(3)  # of noise: 0.07 uT in 20 uT across, first sample alone


# Missing samples


def test_a_gap_of_the_magnetometer_is_predicted_over(waved: motions.Motion) -> None:
    """As if the samples had been rejected; status tells the two apart."""
    missing, wrong = waved.mag.copy(), waved.mag.copy()
    missing[300:350], wrong[300:350] = math.nan, 1e3
    absent, rejected = estimate(waved, missing), estimate(waved, wrong)
    for name in ("x2", "P2", "yaw", "mag_ok"):
        assert np.array_equal(absent[name], rejected[name]), name
    assert np.all(absent["status"][300:350] == Status.MAG_MISSING)
    assert np.all(rejected["status"][300:350] == Status.MAG_REJECTED)
    assert not absent["yaw_innovation"][300:350].any()


@pytest.mark.parametrize("unusable", [math.nan, 0.0, 5e-324, 1e-9], ids=str)
def test_the_first_usable_magnetometer_sample_starts_the_heading(unusable: float, waved: motions.Motion) -> None:
    """Until then yaw counts from the start, by the gyroscope; the late start equals a start of its own."""
    mag = waved.mag.copy()
    mag[:50] = unusable
    result = estimate(waved, mag)
    assert result["yaw"][0] == 0
    turned = waved.R_NS[49] * waved.R_NS[0].inv()
    relative = yaw_error(result, waved)[[0, 49]]
    assert abs(math.remainder(relative[1] - relative[0], 2 * math.pi)) < math.radians(3), turned  # 0.5 s of first order
    flag = Status.MAG_MISSING if math.isnan(unusable) else Status.MAG_REJECTED
    assert np.all(result["status"][:50] == flag) and result["status"][50] == 0
    assert result["yaw"][50] == pytest.approx(result["alpha_m"][50], abs=1e-12)
    assert np.array_equal(result["P2"][50], np.eye(3))


@pytest.mark.parametrize("unusable", [math.nan, 0.0], ids=str)
def test_the_first_usable_accelerometer_sample_starts_both_filters(unusable: float, waved: motions.Motion) -> None:
    accel = waved.accel.copy()
    accel[:7] = unusable
    late = run(BLOCK, inputs_of(waved, accel=accel), FIELD)
    own = run(BLOCK, {name: values[7:] for name, values in inputs_of(waved).items()}, FIELD)
    for name in ("vertical", "q_NS", "P1", "P2", "mag_ok"):
        assert np.array_equal(late[name][7:], own[name]), name
    waiting = Status.NOT_INITIALISED | (Status.ACCEL_MISSING if math.isnan(unusable) else 0)
    assert np.all(late["status"][:7] == waiting) and not late["yaw"][:7].any()
    assert np.array_equal(late["status"][7:], own["status"])


def test_yaw_counts_from_the_start_of_the_tilt_where_the_magnetometer_comes_later(waved: motions.Motion) -> None:
    accel, mag = waved.accel.copy(), waved.mag.copy()
    accel[:7], mag[:50] = math.nan, math.nan
    result = run(BLOCK, inputs_of(waved, accel=accel, mag=mag), FIELD)
    assert np.abs(result["yaw"][:8]).max() < 1e-15
    assert np.abs(result["yaw"][8:50]).min() > 0


def test_directions_that_are_not_normalised_stay_finite_in_an_endless_gap() -> None:
    """(7) and (20) make a direction longer by (w dt)^2 / 2 a sample; at 35 rad/s it overflows within 12 000 samples."""
    spin = motions.turn(Rotation.identity(), np.array([0.0, 0.0, 35.0]), 13_000)
    spin.accel[1:], spin.mag[1:] = math.nan, math.nan
    result = estimate(spin, normalise1=False, normalise2=False)
    for signal in BLOCK.reported:
        values = result[signal.name]
        assert np.all((values >= signal.minimum) & (values <= signal.maximum)), signal.name
