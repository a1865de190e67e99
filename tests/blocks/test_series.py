"""Claims about blocks in series: the numbers are those of the blocks one after the other."""

from __future__ import annotations

import numpy as np
import pytest
from fmpy.fmi1 import FMICallException

from imufmu import System, locate
from imufmu import simulate as cosimulate
from imufmu.blocks.instance import StepError, instantiate
from imufmu.blocks.running import Stream, run, simulate
from imufmu.blocks.series import series
from imufmu.blocks.signals import DeclarationError
from imufmu.estimators import lee2012
from imufmu.plants import handheld, pendulum
from imufmu.plants.human import plant as human_segment
from imufmu.sensors import imu
from support import motions
from support.native_fmus import native

ERRORS = {
    "gyro_bias": (0.01, -0.02, 0.03),
    "gyro_noise_density": 0.01,
    "accel_noise_density": 0.02,
    "accel_range": 30.0,
}


@pytest.fixture
def ideal(rng) -> dict[str, np.ndarray]:
    """What an ideal IMU on a tumbling, shaken sensor reads."""
    motion = motions.motion(rng, 1500)
    return {"angular_velocity": motion.gyro, "specific_force": motion.accel, "magnetic_field": motion.mag}


def of(block: str, parameters: dict) -> dict:
    return {f"{block}.{name}": value for name, value in parameters.items()}


def test_a_smart_sensor_equals_imu_and_estimator_one_after_the_other_bit_for_bit(ideal):
    smart = series(imu.BLOCK, lee2012.BLOCK)
    together = run(smart, ideal, {"seed": 7, **of("imu", ERRORS), "lee2012.c_a": 0.3})
    readings = run(imu.BLOCK, ideal, {"seed": 7, **ERRORS})
    alone = run(lee2012.BLOCK, {"gyro": readings["gyro"], "accel": readings["accel"]}, {"c_a": 0.3})
    for signal in lee2012.BLOCK.outputs:
        assert np.array_equal(together[signal.name], alone[signal.name]), signal.name
    assert np.array_equal(together["imu.gyro"], readings["gyro"])
    assert np.array_equal(together["lee2012.P"], alone["P"])


def test_missing_truth_is_held_by_the_sensor_and_the_estimator_never_sees_it(ideal):
    ideal["angular_velocity"][100:110, 1] = np.nan
    together = run(series(imu.BLOCK, lee2012.BLOCK), ideal)
    assert all(np.isfinite(values).all() for values in together.values.values())
    assert not together["status"].any()


def free_swing(plant):
    return {"motion": 0, "initial_rate": np.ones(plant.inputs[0].size)}


@pytest.mark.parametrize(
    ("plant", "motion"),
    [
        (pendulum.PENDULUM, free_swing(pendulum.PENDULUM)),
        (pendulum.DOUBLE_PENDULUM, free_swing(pendulum.DOUBLE_PENDULUM)),
        (handheld.BLOCK, {"seed": 5}),
    ],
    ids=lambda part: getattr(part, "name", ""),
)
def test_a_whole_chain_equals_its_cosimulation(plant, motion):
    """4 s with noise, drawn by the plant too where it moves at random: each block draws from its own seed.

    1e-12 of each signal's size: time is added up in another order.
    """
    period, rows = 0.01, 401
    own = {
        "plant": motion,
        "imu": {**ERRORS, "sample_period": period, "seed": 3},
        "lee2012": {"sample_period": period, "c_a": 0.3},
    }
    system = System.read(locate(f"{plant.name}_lee2012"))
    given = {f"{component}.{n}": value for component, values in own.items() for n, value in values.items()}
    separate = cosimulate(system, stop_time=(rows - 1) * period, step=period, parameters=given)

    chain = series(plant, imu.BLOCK, lee2012.BLOCK)
    names = {"plant": plant.name, "imu": "imu", "lee2012": "lee2012"}
    bound = {
        f"{names[s.component]}.{s.variable.name}": s.value for s in system.settings_with(given) if s.component in names
    }
    seed = "imu.seed" if plant.normals else "seed"
    shared = {"imu.seed": seed, "imu.sample_period": "sample_period", "lee2012.sample_period": "sample_period"}
    parameters = {shared.get(name, name): value for name, value in bound.items()}
    stream = Stream(chain, parameters)  # a plant without inputs makes a chain without any, which a stream can run
    together = [stream.update() for _ in range(rows)]
    for signal in lee2012.BLOCK.outputs:
        expected = separate[f"lee2012.{signal.name}"][:-1]  # the last row is held
        scale = max(1.0, np.abs(expected).max())
        actual = np.array([row[signal.name] for row in together[:-1]])
        assert np.abs(actual - expected).max() < 1e-12 * scale, signal.name


def test_a_plant_whose_state_starts_at_zero_starts_so_in_a_chain_too():
    """CasADi leaves out zeros that it knows of; written into a buffer, the others would take their places.

    Bit for bit: the first tenth of a second, in which the person stands still.
    """
    person = human_segment.BLOCK
    stream = Stream(series(person, imu.BLOCK, lee2012.BLOCK), {"human_segment.wobble": 1})
    together = [stream.update() for _ in range(10)]
    alone = simulate(person, 0.09, 0.01, parameters={"wobble": 1})
    for name in ("specific_force", "skeleton"):
        assert np.array_equal([row[f"human_segment.{name}"] for row in together], alone[name]), name


def test_a_stream_of_the_chain_equals_the_run(ideal):
    smart = series(imu.BLOCK, lee2012.BLOCK)
    expected = run(smart, ideal, of("imu", ERRORS))["vertical"]
    stream = Stream(smart, of("imu", ERRORS))
    for k in range(50):
        out = stream.update(**{name: values[k] for name, values in ideal.items()})
    assert np.array_equal(out["vertical"], expected[49])


def test_the_sample_period_of_a_plant_chain_cannot_outgrow_the_solver():
    chain = series(pendulum.PENDULUM, imu.BLOCK, lee2012.BLOCK)
    (period,) = (p for p in chain.parameters if p.name == "sample_period")
    assert period.maximum == pytest.approx(10 * pendulum.PENDULUM.longest_step)


@pytest.mark.parametrize(
    ("blocks", "fault"),
    [
        ((lee2012.BLOCK,), "at least two"),
        ((lee2012.BLOCK, imu.BLOCK), "nothing before imu has an output angular_velocity"),
        ((imu.BLOCK, pendulum.PENDULUM), "a plant can only stand first"),
        ((pendulum.PENDULUM, lee2012.BLOCK), "nothing before lee2012 has an output gyro"),
        ((imu.BLOCK, imu.BLOCK), "stands in it twice"),
    ],
)
def test_blocks_that_do_not_fit_are_refused(blocks, fault):
    with pytest.raises(DeclarationError, match=fault):
        series(*blocks)


def test_a_chain_whose_plant_diverges_refuses_the_step_and_keeps_its_state() -> None:
    """As the plant alone does: a damping of 1e4 N.m.s/rad is too stiff for 1 ms. In process and native."""
    chain, stiff = series(pendulum.PENDULUM, imu.BLOCK, lee2012.BLOCK), {"pendulum.damping": 1e4}
    instance = instantiate(chain)
    instance.p[:] = chain.parameter_vector(stiff)
    instance.initialise(0.0)
    compiled = native("pendulum+imu+lee2012").initialise({"pendulum.damping[1]": 1e4})
    for k in range(100):
        before = instance.get_state(), compiled.reals()
        try:
            instance.do_step(0.01 * k, 0.01)
        except StepError as error:
            assert "pendulum_imu_lee2012: not finite at t = " in str(error) and "sample_period below 0.01 s" in str(
                error
            )
            break
        compiled.step(0.01 * k, 0.01)
    else:
        pytest.fail("it did not diverge")
    assert instance.get_state() == before[0]
    with pytest.raises(FMICallException):
        compiled.step(0.01 * k, 0.01)
    assert "sample_period below 0.01 s" in compiled.log[-1][1]
    assert compiled.reals() == before[1]
    compiled.close()
    nothing = {s.name: np.zeros((100, s.size)) for s in chain.inputs}
    with pytest.raises(StepError, match="not finite at t = "):
        run(chain, nothing, stiff)
