"""Claims about plumb_lag: what it tells late is what plumb would have said, had it known what came since."""

from __future__ import annotations

import numpy as np
import pytest

from imufmu.blocks.running import Stream
from imufmu.compiled.offline import run_offline
from imufmu.compiled.running import run
from imufmu.estimators import plumb
from imufmu.estimators.plumb import lag
from support.motions import angle
from support.plumb_motions import BLOCK, G, carried, consumer, moving, part_of, rms, smooth

LAGGED = plumb.LAGGED
DT = 0.01


def told_of(result, vertical: np.ndarray, dt: float = DT) -> tuple[np.ndarray, np.ndarray]:
    """Tilt error (deg) of every row at the instant that it tells of, and that instant's row."""
    rows = np.round(result["sample_time"] / dt).astype(int)
    return np.rad2deg(angle(result["vertical"], vertical[rows])), rows


LONG = pytest.param(0.0035, 2.0, marks=pytest.mark.slow)


@pytest.mark.parametrize(("dt", "wanted"), [(0.01, 0.5), (0.01, 1.99), LONG, (0.001, 0.3), (0.034, 2.0)])
def test_it_is_late_by_whole_blocks_and_says_so(dt: float, wanted: float) -> None:
    """At 1000 Hz there are 16 attitudes kept of a block of 50: one for four samples."""
    motion = moving(70, 4.0, dt=dt)
    result = run(LAGGED, {"gyro": motion.gyro, "accel": motion.accel}, {"sample_period": dt, "lag": wanted})
    block = 0.05 if dt < 0.03 else dt
    late = result.time > wanted + 2 * block
    delay = result["delay"][late]
    stride = max(1, round(0.05 / dt) / lag.SLOTS)
    assert np.all(delay > wanted - dt) and np.all(delay < wanted + block + np.ceil(stride) * dt)
    assert np.allclose(result["sample_time"], result.time - result["delay"], rtol=0, atol=1e-12)
    assert np.all(np.diff(result["sample_time"]) > -1e-9)
    first = result.time <= wanted - block
    assert np.allclose(result["sample_time"][first], 0, atol=1e-9)


def test_it_is_plumb_smoothed_over_what_came_since() -> None:
    """Against the smoother that goes back, over the record as it was known a block ago: two ways to one number."""
    motion = moving(71, 20, rest=2.0).noisy(np.random.default_rng(1), 0.02)
    readings = {"gyro": motion.gyro + np.array([0.004, -0.002, 0.003]), "accel": motion.accel}
    settings = {"sample_period": DT, "g": G, "gyro_index": 1}
    late = run(LAGGED, readings, settings | {"lag": 0.8})
    rows = np.round(late["sample_time"] / DT).astype(int)
    for k in (605, 1213, 1601, 1990):  # within blocks
        begun = k // 5 * 5
        back = run_offline(BLOCK, {name: values[: begun - 4] for name, values in readings.items()}, settings)
        # Rotations are added in one and composed in the other, and here it counts where the block of now began.
        assert np.rad2deg(angle(late["vertical"][[k]], back["vertical"][[rows[k]]]))[0] < 0.01
        assert late["tilt_std"][k] == pytest.approx(back["tilt_std"][rows[k]], rel=0.05)


def test_a_start_in_motion_is_bearable_a_second_later() -> None:
    motion = moving(60, 40, speed=0.5)
    late, readings = part_of(motion, slice(100, None)), {n: v[100:] for n, v in consumer(motion).items()}
    settings = {"sample_period": DT, "g": G, "gyro_index": 1}
    now, then = run(BLOCK, readings, settings), run(LAGGED, readings, settings | {"lag": 1.0})
    error, rows = told_of(then, late.vertical)
    first = (rows < 1000) & (np.diff(rows, append=rows[-1] + 1) > 0)
    assert rms(np.rad2deg(angle(now["vertical"], late.vertical))[:1000]) > 2
    assert rms(error[first]) < 1.2
    assert np.all(error[100:] < 3 * np.rad2deg(then["tilt_std"][100:]))


def test_what_was_wrong_is_mended_as_far_as_the_lag_goes() -> None:
    """A tenth of a second is lost in a turn that ends in rest; plumb notices it four seconds later."""
    t = np.arange(0, 30, DT)
    motion = carried(t, roll=np.radians(90) * smooth(t, 20, 1.2))
    kept = np.delete(np.arange(len(t)), slice(2055, 2065))
    readings = {name: rows[kept] for name, rows in consumer(motion).items()}
    settings = {"sample_period": DT, "g": G}
    now, then = run(BLOCK, readings, settings), run(LAGGED, readings, settings | {"lag": 2.0})
    error, rows = told_of(then, motion.vertical[kept])
    wrong = np.rad2deg(angle(now["vertical"], motion.vertical[kept])) > 3
    assert wrong.sum() > 100
    assert len(np.unique(rows[error > 3])) < 0.6 * wrong.sum()


def test_bytes_of_the_stream_are_those_of_the_run() -> None:
    motion = moving(72, 3.0)
    result = run(LAGGED, {"gyro": motion.gyro, "accel": motion.accel}, {"lag": 0.3})
    stream = Stream(LAGGED, {"lag": 0.3})
    for k in range(len(motion.gyro)):
        out = stream.update(gyro=motion.gyro[k], accel=motion.accel[k])
        assert out["sample_time"] == result["sample_time"][k]
        assert np.allclose(out["vertical"], result["vertical"][k], rtol=0, atol=1e-12)
