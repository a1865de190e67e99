"""The master: what a row of the result means, in which order FMUs step, how few calls that takes."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import fmpy
import numpy as np
import pytest

from imufmu import WiringError
from imufmu.cosim import master
from support.cosim_stubs import Call, binding, recorded_calls, simulate, stub, write_ssd

H = 0.25  # s, a power of two: every time below is exact
TIMES = np.arange(5) * H


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[Call]:
    return recorded_calls(monkeypatch)


def chain(folder: Path, *connections: str, **options: Any) -> Path:
    """A system of the components that the connections name; the stub is the name without digits."""
    names = dict.fromkeys(end.split(".")[0] for c in connections for end in c.split(" | ")[0].split(" ")[:3:2])
    return write_ssd(
        folder / "chain.ssd", {name: stub(name.rstrip("0123456789")) for name in names}, connections, **options
    )


def test_truth_and_sample_of_a_row_belong_to_the_same_instant(tmp_path: Path) -> None:
    result = simulate(chain(tmp_path, "clock.y -> sampler1.u", "sampler1.y -> sampler2.u"))
    assert result.time.tolist() == TIMES.tolist()
    assert result["clock.y"].tolist() == TIMES.tolist()
    for sampler in ("sampler1", "sampler2"):
        assert result[f"{sampler}.y"][:-1].tolist() == TIMES[:-1].tolist()
        assert result[f"{sampler}.sample_time"][:-1].tolist() == TIMES[:-1].tolist()


def test_the_last_row_holds_the_last_sample_and_says_so(tmp_path: Path) -> None:
    result = simulate(chain(tmp_path, "clock.y -> sampler.u"))
    assert result["clock.y"][-1] == 1.0
    assert result["sampler.y"][-1] == result["sampler.sample_time"][-1] == 0.75


def test_jacobi_delays_by_one_step_per_connection_from_a_sampled_fmu(tmp_path: Path) -> None:
    system = chain(tmp_path, "clock.y -> sampler1.u", "sampler1.y -> sampler2.u", "sampler2.y -> sampler3.u")
    result = simulate(system, jacobi=True)
    assert result["sampler1.y"][:-1].tolist() == TIMES[:-1].tolist()
    assert result["sampler2.y"][:-1].tolist() == [-1, *TIMES[:3]]  # -1: the start value
    assert result["sampler3.y"][:-1].tolist() == [-1, -1, *TIMES[:2]]


def test_a_chain_of_continuous_fmus_is_in_step_and_lags_by_one_in_jacobi(tmp_path: Path) -> None:
    system = chain(tmp_path, "clock.y -> adder.u")
    assert simulate(system)["adder.y"].tolist() == (TIMES + 1).tolist()
    assert simulate(system, jacobi=True)["adder.y"].tolist() == [1, *(TIMES[:-1] + 1)]


def test_the_order_of_the_description_does_not_matter(tmp_path: Path) -> None:
    connections = ["clock.y -> sampler1.u", "sampler1.y -> sampler2.u"]
    stubs = {name: stub(name.rstrip("12")) for name in ("clock", "sampler1", "sampler2")}
    forwards = simulate(write_ssd(tmp_path / "a.ssd", stubs, connections))
    backwards = simulate(write_ssd(tmp_path / "b.ssd", dict(reversed(stubs.items())), reversed(connections)))
    for name in forwards.names:
        assert forwards[name].tolist() == backwards[name].tolist()


def test_a_connection_written_from_input_to_output_is_the_same_connection(tmp_path: Path) -> None:
    connectors = {
        "sampler.u": '<ssd:Connector name="u" kind="input"/>',
        "clock.y": '<ssd:Connector name="y" kind="output"/>',
    }
    result = simulate(chain(tmp_path, "sampler.u -> clock.y", connectors=connectors))
    assert result["sampler.y"][:-1].tolist() == TIMES[:-1].tolist()


def test_a_sampled_controller_closes_the_loop_without_extra_delay(tmp_path: Path) -> None:
    system = chain(tmp_path, "clock.y -> sampler.u", "sampler.y -> clock.u")
    result = simulate(system)
    y = [-1.0]  # the controller's start value reaches the plant during initialisation
    for t in TIMES[1:]:
        y.append(t + y[-1])  # the plant steps with the controller's answer to its own last output
    assert result["clock.y"].tolist() == y
    assert not any("loop" in note for note in result.notes)
    delayed = [-1.0, 0.25 - 1.0, 0.5 - 1.0, 0.75 + (0.25 - 1.0), 1.0 + (0.5 - 1.0)]
    assert simulate(system, jacobi=True)["clock.y"].tolist() == delayed


def test_a_loop_of_sampled_fmus_is_broken_at_the_first_named_and_told(tmp_path: Path) -> None:
    system = chain(tmp_path, "sampler2.y -> sampler1.u", "sampler1.y -> sampler2.u", "clock.y -> sampler3.u")
    notes = [note for note in simulate(system).notes if "loop" in note]
    assert notes == ["loop of connections: sampler1.y -> sampler2.u carries the value from before the step"]


def test_outputs_settle_along_a_chain_during_initialisation(tmp_path: Path) -> None:
    system = chain(tmp_path, "adder3.y -> adder4.u", "adder2.y -> adder3.u", "adder1.y -> adder2.u")
    result = simulate(system)
    assert [result[f"adder{i}.y"][0] for i in (1, 2, 3, 4)] == [1, 2, 3, 4]
    assert not any("settle" in note for note in result.notes)


def test_outputs_that_never_settle_are_told(tmp_path: Path) -> None:
    notes = simulate(chain(tmp_path, "adder1.y -> adder2.u", "adder2.y -> adder1.u")).notes
    assert "outputs did not settle in 3 exchanges during initialisation" in notes
    assert any("loop of connections: adder2.y -> adder1.u" in note for note in notes)


def test_integers_and_booleans_travel_too(tmp_path: Path) -> None:
    result = simulate(chain(tmp_path, "clock.steps -> sampler.n", "clock.even -> sampler.b"))
    assert result["sampler.m"][:-1].tolist() == [0, 1, 2, 3]
    assert result["sampler.c"][:-1].tolist() == [1, 0, 1, 0]
    assert result["sampler.m"].dtype == np.int32


def test_a_linear_transformation_is_applied(tmp_path: Path) -> None:
    system = chain(tmp_path, "clock.y -> sampler.u |<ssc:LinearTransformation factor='2' offset='3'/>")
    assert simulate(system)["sampler.y"][:-1].tolist() == (3 + 2 * TIMES[:-1]).tolist()


def test_times_are_counted_not_summed(tmp_path: Path) -> None:
    result = simulate(chain(tmp_path, "clock.y -> sampler.u"), start_time=0.1, stop_time=100.1, step=0.1)
    assert len(result.time) == 1001
    expected = 0.1 + np.arange(1001) * 0.1  # bit for bit: a sum of 1000 steps would be off by some 1e-12
    assert result.time.tolist() == expected.tolist()
    assert result["sampler.sample_time"][:-1].tolist() == expected[:-1].tolist()


def test_a_stop_time_between_communication_points_is_passed_by_the_last_step(tmp_path: Path) -> None:
    system = chain(tmp_path, "clock.y -> sampler.u")
    assert simulate(system, stop_time=1.1).time[-1] == 1.25
    assert simulate(system, stop_time=0.3, step=0.1).time[-1] == pytest.approx(0.3)  # 0.3 / 0.1 is above 3 by rounding


def test_rounding_of_times_far_from_zero_adds_no_step(tmp_path: Path) -> None:
    system = chain(tmp_path, "clock.y -> sampler.u")
    start, h = 1.7e9 + 0.3, 0.01
    steps = next(k for k in range(1, 100) if (start + k * h - start) / h > k + 1e-6)
    assert len(simulate(system, start_time=start, stop_time=start + steps * h, step=h).time) == steps + 1


def test_parameters_come_from_the_description_and_give_way_to_the_argument(tmp_path: Path) -> None:
    own = binding({"offset": ("Real", 10, None), "start_steps": ("Integer", 7, None)})
    of_system = binding({"clock.offset": ("Real", 20, None)})
    system = chain(tmp_path, "clock.y -> sampler.u", bindings={"clock": own, "": of_system})
    result = simulate(system)
    assert result["clock.y"][0] == 20
    assert result["clock.steps"][0] == 7
    assert simulate(system, parameters={"clock.offset": 30})["clock.y"][0] == 30


def test_only_what_is_asked_for_is_recorded(tmp_path: Path) -> None:
    system = chain(tmp_path, "clock.y -> sampler.u")
    assert simulate(system).names == [
        *("clock.y", "clock.steps", "clock.even"),
        *("sampler.y", "sampler.m", "sampler.c", "sampler.sample_time"),
    ]
    result = simulate(system, record=["sampler.inside", "sampler.m", "clock.u"])
    assert result.names == ["sampler.inside[1]", "sampler.inside[2]", "sampler.m", "clock.u"]
    assert result["sampler.inside"][:-1].tolist() == [[10 * t, 20 * t] for t in TIMES[:-1]]
    with pytest.raises(
        WiringError, match=r"record 'sampler\.insid': there is no such variable\. Near: sampler\.inside"
    ):
        simulate(system, record=["sampler.insid"])


def test_one_get_and_one_set_per_fmu_and_step(tmp_path: Path, calls: list[Call]) -> None:
    simulate(chain(tmp_path, "clock.y -> sampler.u"), record=["clock.y", "sampler.y", "sampler.sample_time"])
    counted = Counter((instance, function) for instance, function, _ in calls)
    start = 3  # two sweeps until the outputs have settled, and one get after initialisation
    assert counted["sampler", "fmi2DoStep"] == counted["clock", "fmi2DoStep"] == 4
    assert counted["sampler", "fmi2GetReal"] == counted["clock", "fmi2GetReal"] == start + 4
    assert counted["sampler", "fmi2SetReal"] == start - 1 + 4
    assert counted["clock", "fmi2SetReal"] == counted["clock", "fmi2GetInteger"] == 0


def test_during_initialisation_nothing_but_outputs_is_read(tmp_path: Path, calls: list[Call]) -> None:
    simulate(chain(tmp_path, "clock.y -> sampler.u"), record=["sampler.inside", "sampler.y"])
    sampler = [(function, arguments) for instance, function, arguments in calls if instance == "sampler"]
    initialised = [function for function, _ in sampler].index("fmi2ExitInitializationMode")
    output = {v.name: v.valueReference for v in fmpy.read_model_description(str(stub("sampler"))).modelVariables}["y"]
    for at, (function, arguments) in enumerate(sampler):
        if function == "fmi2GetReal":
            _, references, count, _ = arguments
            assert references[0] == output
            assert count == (1 if at < initialised else 3)


def test_two_components_share_one_fmu(tmp_path: Path) -> None:
    system = chain(tmp_path, "clock1.y -> sampler1.u", "clock2.y -> sampler2.u")
    result = simulate(system, parameters={"clock2.offset": 5})
    assert (result["sampler2.y"] - result["sampler1.y"]).tolist() == [5] * 5


def test_step_and_stop_time_come_from_description_fmus_or_argument(tmp_path: Path) -> None:
    silent = chain(tmp_path, "clock.y -> sampler.u", stop=None, step=None)
    with pytest.raises(ValueError, match=r"chain\.ssd does not say stop_time and step: give stop_time and step"):
        simulate(silent)
    assert len(simulate(silent, stop_time=1.0, step=0.5).time) == 3


@pytest.mark.parametrize(
    "times", [{"step": 0}, {"step": -1}, {"step": np.nan}, {"stop_time": 0}, {"stop_time": np.inf}, {"start_time": 2}]
)
def test_impossible_times_are_refused(tmp_path: Path, times: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="cannot run from"):
        simulate(chain(tmp_path, "clock.y -> sampler.u"), **times)


def test_a_step_in_the_wrong_unit_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="are the times in seconds"):
        simulate(chain(tmp_path, "clock.y -> sampler.u"), step=1e-9)


@pytest.mark.parametrize(("step", "told"), [(0.125, False), (0.25, False), (0.5, True), (0.1, True)])
def test_samples_off_the_communication_points_are_told(tmp_path: Path, step: float, told: bool) -> None:
    result = simulate(chain(tmp_path, "clock.y -> sampler.u"), step=step)
    assert any("sampler: samples every 0.25 s, inputs every" in note for note in result.notes) == told
    tuned = simulate(chain(tmp_path, "clock.y -> sampler.u"), step=step, parameters={"sampler.sample_period": step})
    assert not any("samples every" in note for note in tuned.notes)


def test_progress_ends_with_all_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(master, "_BETWEEN_PROGRESS", -1.0)
    reports: list[tuple[int, int]] = []
    simulate(chain(tmp_path, "clock.y -> sampler.u"), progress=lambda *report: reports.append(report))
    assert reports == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_inputs_left_open_are_told(tmp_path: Path) -> None:
    notes = simulate(chain(tmp_path, "clock.y -> sampler.u")).notes
    assert "sampler: not connected, at their start values: n, b" in notes
