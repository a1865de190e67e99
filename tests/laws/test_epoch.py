"""A start at 1.7e9 s, a date in seconds since 1970, gives the numbers of a start at 0, by every way to run a block."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imufmu.compiled.running import run
from imufmu.cosim.replay import estimator_fmu, replay
from imufmu.files.csv_table import write_csv
from imufmu.recordings.reading import read
from imufmu.registry import BLOCKS
from support import fmu
from support.fmu import refusal

EPOCH = 1.7e9
ROWS = 400
KIND = pytest.mark.parametrize("kind", fmu.KINDS)


def readings(rows: int = ROWS) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(6)
    return {"gyro": rng.normal(0, 0.3, (rows, 3)), "accel": rng.normal((0.0, 1.0, 9.7), 0.3, (rows, 3))}


def stepped(kind: str, start: float, times: np.ndarray, h: np.ndarray) -> np.ndarray:
    """What lee2012 reports, and the number of its last sample, after every step from ``times`` by ``h``."""
    instance = fmu.Fmu("lee2012", kind=kind).initialise(start_time=start)
    given, rows = readings(len(times)), []
    outputs = [n for s in BLOCKS["lee2012"].reported for n in s.element_names()]
    for k, (t, step) in enumerate(zip(times.tolist(), h.tolist(), strict=True)):
        for name, values in given.items():
            instance.set(fmu.elements(name, values[k]))
        instance.step(t, step)
        (sample_time,) = instance.get("sample_time")
        rows.append([*instance.get(*outputs), round((sample_time - start) / 0.01)])
    instance.close()
    return np.array(rows)


@KIND
@pytest.mark.parametrize("ratio", [1.0, 0.3, 2.5])
def test_an_fmu_that_starts_far_from_zero_takes_the_same_samples(kind: str, ratio: float) -> None:
    k, h = np.arange(ROWS), np.full(ROWS, 0.01 * ratio)
    early, late = (stepped(kind, start, start + k * h, h) for start in (0.0, EPOCH))
    assert np.array_equal(late, early)


@KIND
def test_an_fmu_follows_a_master_that_adds_up_its_time_far_from_zero(kind: str) -> None:
    """5 ms are 20971.52 spacings of doubles there: its time runs fast by 23 ppm, by two samples in these 1000 steps."""
    h = np.full(1000, 0.005)
    times = np.add.accumulate(np.append(EPOCH, h))[:-1]
    assert times[-1] - EPOCH > 999.02 * 0.005
    early, late = stepped(kind, 0.0, np.arange(1000) * 0.005, h), stepped(kind, EPOCH, times, h)
    assert np.array_equal(late, early)


@KIND
def test_a_state_saved_far_from_zero_goes_on_with_the_next_sample(kind: str) -> None:
    instance = fmu.Fmu("lee2012", kind=kind).initialise(start_time=EPOCH)
    instance.step(EPOCH, 0.013)
    saved = fmu.serialised(instance)
    for _ in range(2):
        for k in range(1, 20):
            instance.step(EPOCH + 0.013 * k, 0.013)
        assert round((instance.get("sample_time")[0] - EPOCH) / 0.01) == 25
        fmu.restore(instance, saved)
    instance.close()


@pytest.mark.parametrize("rate", [100.0, 120.0, 285.7])
@pytest.mark.parametrize("native", [False, True])
def test_a_recording_with_dates_is_replayed_as_one_that_starts_at_zero(
    rate: float, native: bool, tmp_path: Path
) -> None:
    """Bit for bit, rows missing in it; and as the run on arrays."""
    kept = np.delete(np.arange(ROWS), [50, 51, 200])
    replayed = []
    for name, start in (("early.csv", 0.0), ("late.csv", EPOCH)):
        columns = {"time": start + kept / rate, **{name: values[kept] for name, values in readings().items()}}
        write_csv(tmp_path / name, columns)
        recording = read(tmp_path / name)
        replayed.append(replay(recording, estimator_fmu("lee2012", native=native)).columns)
    early, late = replayed
    for name in early:
        if name != "sample_time":
            assert np.array_equal(late[name], early[name]), name
    assert late["sample_time"] - EPOCH == pytest.approx(early["sample_time"], abs=3e-7)  # doubles there
    gaps = {name: np.where(np.isin(np.arange(ROWS), kept)[:, None], v, np.nan) for name, v in readings().items()}
    direct = run(BLOCKS["lee2012"], gaps, {"sample_period": float(f"{1 / rate:.12g}")}, start_time=EPOCH)
    assert np.array_equal(late["roll"], direct["roll"][kept])


# The rest of the clock, which FMUs of both kinds share with the run in process


@KIND
@pytest.mark.parametrize(("beyond", "taken"), [(-0.5e-6, 3), (0.5e-6, 3), (2e-6, 4), (0.3, 4)])
def test_a_step_that_ends_a_little_after_an_instant_does_not_contain_it(kind: str, beyond: float, taken: int) -> None:
    """A little is a millionth of a sample."""
    instance = fmu.Fmu("lee2012", kind=kind).initialise()
    instance.step(0.0, 0.03 + 0.01 * beyond)
    assert instance.get("sample_time") == [pytest.approx(0.01 * (taken - 1))]
    instance.close()


@KIND
@pytest.mark.parametrize("name", ["lee2012", "pendulum"])
def test_a_step_of_more_than_a_million_internal_steps_is_refused(kind: str, name: str) -> None:
    """Nothing could interrupt it."""
    instance = fmu.Fmu(name, kind=kind).initialise()
    internal = 0.01 if name == "lee2012" else BLOCKS[name].longest_step
    before = instance.reals()
    message = refusal(instance, lambda: instance.step(0.0, 1.001e6 * internal))
    assert "is more than 1" in message and "internal steps" in message
    assert instance.reals() == before
    instance.step(0.0, 10 * internal)
    instance.close()
