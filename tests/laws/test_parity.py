"""Every backend gives the numbers of the run in process: where the laws' ordinary runs with defaults do not look."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from imufmu import System, locate, pack, simulate
from imufmu.blocks.instance import instantiate
from imufmu.cosim.replay import estimator_fmu
from imufmu.files.locations import models_folder
from imufmu.fmi.model_description import guid
from imufmu.fmi.native import cached_native_fmu
from imufmu.registry import BLOCKS
from support import fmu, golden
from support.arm import golden_inputs, golden_parameters
from support.backends import BACKENDS, Backend, InProcess

OF_PAPER = {"lee2012": "lee2012", "leechoi": "leechoi2018", "rizun": "rizun2008", "zihajehzadeh": "zihajehzadeh2014"}
CASES = [(block, case) for paper, block in OF_PAPER.items() if block in BLOCKS for case in golden.names(paper)]
COLUMNS = {"gyro": "gyro", "accel": "acc", "mag": "mag"}
SYSTEMS = sorted(path.stem for path in models_folder().rglob("*.ssd"))


BACKEND = pytest.mark.parametrize("backend", BACKENDS[1:], ids=lambda backend: backend.name)


@BACKEND
@pytest.mark.parametrize(("name", "case"), CASES, ids=[case for _, case in CASES])
def test_a_record_of_the_reference_vectors_gives_the_numbers_of_the_run_in_process(
    name: str, case: str, backend: Backend
) -> None:
    """Bit for bit, with the numbers among the case's parameters that the block has by the same name."""
    block, record = BLOCKS[name], golden.load(case)
    rows = min(500, len(next(iter(record.inputs.values()))))
    inputs = {s.name: golden.columns(record.inputs, COLUMNS[s.name], 3)[:rows] for s in block.inputs}
    numbers = {name: value for name, value in record.parameters.items() if isinstance(value, int | float)}
    parameters = {p.name: numbers[p.name] for p in block.own_parameters if p.name in numbers}
    parameters["sample_period"] = numbers["dt"]
    expected, actual = (b.run(block, inputs, parameters, rows) for b in (InProcess(), backend))
    for signal in block.reported:
        assert np.array_equal(actual[signal.name], expected[signal.name]), signal.name


@BACKEND
@pytest.mark.parametrize("case", golden.names("bennett"))
def test_a_record_of_an_arm_gives_the_numbers_of_the_run_in_process(case: str, backend: Backend) -> None:
    """Bit for bit, with every number of the case."""
    block, record = BLOCKS["bennett2014"], golden.load(case)
    inputs = {name: values[:500] for name, values in golden_inputs(record).items()}
    parameters = golden_parameters(case, record)
    expected, actual = (b.run(block, inputs, parameters, 500) for b in (InProcess(), backend))
    for signal in block.reported:
        assert np.array_equal(actual[signal.name], expected[signal.name]), signal.name


@BACKEND
@pytest.mark.parametrize("seed", [0, 7, 2**31 - 1])
def test_the_noise_of_a_seed_is_the_same_draw_by_draw(seed: int, backend: Backend) -> None:
    """An IMU at rest with white noise and drift: its readings are its draws. 300 samples, more than are drawn ahead."""
    block = BLOCKS["imu"]
    on = {q.name: q.nominal for q in block.parameters if q.name.endswith(("noise_density", "bias_instability"))}
    expected, actual = (b.run(block, {}, on | {"seed": seed}, 300) for b in (InProcess(), backend))
    for signal in block.outputs:
        assert np.array_equal(actual[signal.name], expected[signal.name]), signal.name
        assert len(np.unique(expected[signal.name])) == 900


@pytest.mark.parametrize("kind", fmu.KINDS)
@pytest.mark.parametrize(("h", "max_step"), [(0.1 * 3, 0.1), (0.0101, 0.001), (1e-9, 1e-3), (5e-11, 0.1), (0.5, 0.001)])
def test_a_plant_takes_the_same_solver_steps(h: float, max_step: float, kind: str) -> None:
    """Also where rounding makes h a little longer than a whole number of the longest steps."""
    block = BLOCKS["double_pendulum"]
    expected = instantiate(block)
    expected.p[:] = block.parameter_vector({"max_step": max_step})
    expected.initialise(0.0)
    actual = fmu.Fmu(block.name, kind=kind).initialise({"max_step": max_step})
    for k in range(3):
        expected.do_step(k * h, h)
        actual.step(k * h, h)
        assert actual.reals() == expected.y.tolist()
    actual.close()


@pytest.mark.parametrize("system", SYSTEMS)
def test_a_system_of_native_fmus_gives_the_numbers_of_the_python_fmus(system: str) -> None:
    expected, actual = (simulate(system, stop_time=1.0, native=native) for native in (False, True))
    assert actual.names == expected.names
    assert all(actual[name].tolist() == expected[name].tolist() for name in expected.names)


def test_native_fmus_are_those_of_our_blocks_in_a_system_a_pack_and_a_replay(tmp_path: Path) -> None:
    systems = [System.read(locate("pendulum_lee2012"), native=True)]
    systems.append(System.read(pack(locate("pendulum_lee2012"), tmp_path / "a.ssp", native=True)))
    for system in systems:
        for part in system.parts:
            assert part.model.guid == guid(BLOCKS[part.model.modelName], native=True)
    assert estimator_fmu("lee2012", native=True) == cached_native_fmu("lee2012")
