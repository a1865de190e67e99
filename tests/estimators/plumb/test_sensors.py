"""Claims about plumb and what a sensor may be like: its range, its accelerometer's errors, the timing of its rates."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.blocks.vocabulary import Status
from support.plumb_motions import G, carried, consumer, mean_rates, moving, rms, smooth, tilt_of

DT = 0.01
T = np.arange(4500) * DT
LIMIT = np.radians(500)
HALF_TURN = 1.1 * np.pi / LIMIT  # s; half a turn at nearly twice as fast as the gyroscope can read
ENDS = round((20 + HALF_TURN) / DT)


def test_a_range_that_is_known_makes_the_filter_doubt_at_once_and_find_back() -> None:
    """A flick faster than the gyroscope reads. With its range unknown it doubts, too, but later and less."""
    motion = carried(T, roll=np.pi * smooth(T, 20, HALF_TURN))
    readings = consumer(motion)
    whole, _ = tilt_of(motion, readings)
    clipped = readings | {"gyro": np.clip(readings["gyro"], -LIMIT, LIMIT)}
    error, known = tilt_of(motion, clipped, gyro_range=LIMIT)
    _, unknown = tilt_of(motion, clipped)
    assert whole.max() < 1
    assert error[ENDS] > 10
    assert known["tilt_std"][ENDS] > unknown["tilt_std"][ENDS]
    assert error[ENDS + 500 :].max() < 3  # five seconds of rest later


def test_a_swing_that_slows_down_by_itself_is_not_taken_for_clipped() -> None:
    """Fast turns whose rate rounds its tops: as if the range were known to be never reached."""
    motion = moving(50, 40, rate=3.0, rest=3.0)
    assert np.abs(motion.gyro).max() > 6
    error, unknown = tilt_of(motion, consumer(motion))
    _, known = tilt_of(motion, consumer(motion), gyro_range=40.0)
    assert np.array_equal(unknown["vertical"], known["vertical"])
    assert rms(error) < 1


@pytest.mark.parametrize("scale", [0.96, 1.04])
@pytest.mark.parametrize("offset", [(0.8, 0.0, 0.0), (0.0, -0.8, 0.0), (0.0, 0.0, 0.8)])
def test_an_accelerometer_that_is_off_by_80_mg_and_4_percent_still_shows_rest(
    scale: float, offset: tuple[float, float, float]
) -> None:
    """In three attitudes, with a turn between: the bias is learnt there, and the tilt is off by the offset's, 5 deg."""
    turns = smooth(T, 12, 1), smooth(T, 28, 1)
    motion = carried(T, roll=np.pi / 3 * turns[0], pitch=-np.pi / 3 * turns[1])
    readings = consumer(motion)
    readings["accel"] = scale * readings["accel"] + np.array(offset)
    error, result = tilt_of(motion, readings)
    for first, last in ((3, 12), (18, 28), (34, 45)):
        assert result["stationary"][round(first / DT) : round(last / DT)].mean() > 0.7, first
    assert np.abs(result["gyro_bias"][-1] - [0.005, -0.003, 0.004]).max() < np.radians(0.1)
    assert error.max() < 1.2 * np.degrees(0.8 / (0.96 * G))


def as_read(seed: int, instants: bool) -> tuple[object, dict[str, np.ndarray]]:
    """A motion at 40 Hz, and the rates of a device: means over the period before a sample, or values at the instant."""
    fine = moving(seed, 40, dt=0.0125, rate=1.2, rest=3.0)
    rows = np.arange(0, len(fine.gyro) - 1, 2)
    R_NS = fine.R_NS[rows]
    gyro = (fine.gyro[rows] + fine.gyro[rows + 1]) / 2 if instants else mean_rates(R_NS, 0.025)
    motion = type(fine)(
        0.025, gyro, fine.accel[rows], fine.mag[rows], fine.vertical[rows], fine.acceleration[rows], R_NS
    )
    return motion, {"gyro": gyro, "accel": motion.accel}


@pytest.mark.parametrize("seed", [51, 52])
def test_the_default_timing_is_never_the_worst_and_costs_half_of_the_wrong_one(seed: int) -> None:
    """Of a device of which nothing is known: the largest error over both kinds is smallest with gyro_index = 3."""
    errors = {}
    for instants in (False, True):
        motion, readings = as_read(seed, instants)
        for index in (1, 2, 3):
            error, _ = tilt_of(motion, readings, gyro_index=index)  # type: ignore[arg-type]
            errors[instants, index] = rms(error[400:])
    right, wrong = {False: 1, True: 2}, {False: 2, True: 1}
    for instants in (False, True):
        assert errors[instants, right[instants]] < errors[instants, 3] < 0.65 * errors[instants, wrong[instants]]
    worst = {index: max(errors[False, index], errors[True, index]) for index in (1, 2, 3)}
    assert min(worst, key=lambda index: worst[index]) == 3


@pytest.mark.parametrize(
    ("name", "reading", "parameters", "flag"),
    [
        ("gyro", 80.0, {}, Status.GYRO_MISSING),  # rad/s; twice 2000 deg/s are 70
        ("gyro", 20.0, {"gyro_range": LIMIT}, Status.GYRO_MISSING),
        ("accel", 1200.0, {}, Status.ACCEL_MISSING),  # m/s2
        ("accel", 200.0, {"accel_range": 16 * G}, Status.ACCEL_MISSING),
    ],
)
def test_what_no_such_sensor_can_read_counts_as_missing(
    name: str, reading: float, parameters: dict[str, float], flag: Status
) -> None:
    """Within what any sensor reads, but beyond the range of this one: as if the sample were not there."""
    motion = moving(53, 12, rate=1.0, rest=3.0)
    wrong, holes = consumer(motion), consumer(motion)
    wrong[name][800], holes[name][800] = reading, np.nan
    (error, found), (_, missing) = (tilt_of(motion, readings, **parameters) for readings in (wrong, holes))
    assert found["status"][800] == flag and error.max() < 1
    assert np.array_equal(found["vertical"], missing["vertical"])


def test_a_level_that_is_not_quite_even_is_clipped_too() -> None:
    """A device that calibrates its readings after they were clipped: its largest ones differ by a thousandth."""
    motion = carried(T, roll=np.pi * smooth(T, 20, HALF_TURN))
    clipped, whole = consumer(motion), consumer(motion)
    over = np.abs(clipped["gyro"]) > LIMIT
    uneven = LIMIT * (1 + np.random.default_rng(54).uniform(-1e-3, 1e-3, over.shape))
    clipped["gyro"] = np.where(over, np.sign(clipped["gyro"]) * uneven, clipped["gyro"])
    (error, found), (_, unclipped) = tilt_of(motion, clipped), tilt_of(motion, whole)
    assert over.sum() >= 20 and error[ENDS] > 10
    assert found["tilt_std"][ENDS] > 2 * unclipped["tilt_std"][ENDS]
    assert error[ENDS + 500 :].max() < 3
