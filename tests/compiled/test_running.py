"""Compiled blocks give the numbers of the interpreter, and where there is no compiler the interpreter serves."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imufmu.blocks import running as interpreted
from imufmu.blocks.block import ContinuousBlock, SampledBlock
from imufmu.compiled import library, rows, running
from imufmu.registry import BLOCKS
from support import motions
from support.optional import needs
from support.toys import LAZY, MIRROR, OSCILLATOR

# The toys show all that the loop over rows hands to a block: inputs before, draws, the time of every solver step.
SAMPLED = [MIRROR, LAZY, *(block for block in BLOCKS.values() if isinstance(block, SampledBlock))]
CONTINUOUS = [OSCILLATOR, *(block for block in BLOCKS.values() if isinstance(block, ContinuousBlock))]
needs_compiler = needs("a C compiler")


@pytest.fixture
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Compile for the first row."""
    monkeypatch.setattr(library, "_ROWS_FOR_A_COMPILATION", 0)


@pytest.fixture
def fresh(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, at_once: None) -> Iterator[Path]:
    """An empty cache, and nothing known about any block."""
    monkeypatch.setattr(library, "user_cache_path", lambda _name: tmp_path)
    for known in (library.compiled, library._say_once, library._loaded):
        known.cache_clear()
    yield tmp_path
    for known in (library.compiled, library._say_once, library._loaded):
        known.cache_clear()


def readings(block: SampledBlock, rows: int) -> dict[str, np.ndarray]:
    """What a moving, noisy sensor tells, with gaps; inputs that it does not have stay near their start."""
    rng = np.random.default_rng(5)
    moved = motions.motion(rng, rows).noisy(rng)
    known = {"gyro": moved.gyro, "accel": moved.accel, "mag": moved.mag}
    inputs = {}
    for signal in block.inputs:
        noise = rng.normal(0, 0.1, (rows, *signal.shape))
        inputs[signal.name] = known.get(signal.name, np.array(signal.start_values()).reshape(signal.shape) + noise)
        inputs[signal.name][rows // 3 : rows // 3 + 20] = np.nan
    return inputs


@needs_compiler
@pytest.mark.parametrize("block", SAMPLED, ids=lambda block: block.name)
def test_a_compiled_record_is_the_interpreted_one_to_the_last_bit(block: SampledBlock, at_once: None) -> None:
    inputs = readings(block, 600)
    here, there = running.run(block, inputs), interpreted.run(block, inputs)
    assert library.compiled(block).library(0) is not None
    for name, values in there.values.items():
        assert np.array_equal(here[name], values, equal_nan=True), name


@needs_compiler
@pytest.mark.parametrize("block", CONTINUOUS, ids=lambda block: block.name)
def test_a_compiled_plant_is_the_interpreted_one_to_the_last_bit(block: ContinuousBlock, at_once: None) -> None:
    rng = np.random.default_rng(6)
    inputs = {s.name: s.start_values() + rng.uniform(0, 0.1, (51, s.size)) for s in block.inputs}
    here, there = (way.simulate(block, 1.0, 0.02, inputs, start_time=5.0) for way in (running, interpreted))
    assert library.compiled(block).library(0) is not None
    for name, values in there.values.items():
        assert np.array_equal(here[name], values, equal_nan=True), name


@needs_compiler
def test_a_long_record_goes_on_where_a_portion_ends(at_once: None, monkeypatch: pytest.MonkeyPatch) -> None:
    block = BLOCKS["imu"]
    whole = running.run(block, readings(block, 300))
    monkeypatch.setattr(interpreted, "_PORTION", 100)
    in_portions = running.run(block, readings(block, 300))
    assert all(np.array_equal(whole[name], in_portions[name]) for name in whole.values)


@needs_compiler
@pytest.mark.parametrize("steps", [70, 10])
def test_a_long_simulation_goes_on_where_a_call_ends(
    steps: int, at_once: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """So that it can be interrupted between calls. 51 rows of 20 solver steps, three of them in a call, or one."""
    whole = running.simulate(BLOCKS["pendulum"], 1.02, 0.02)
    monkeypatch.setattr(rows, "_SOLVER_STEPS", steps)
    in_calls = running.simulate(BLOCKS["pendulum"], 1.02, 0.02)
    assert all(np.array_equal(whole[name], in_calls[name]) for name in whole.values)


def test_without_a_compiler_the_interpreter_serves_and_says_so_once(
    fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("imufmu.compiled.compilers.has_ziglang", lambda: False)
    monkeypatch.setenv("CC", "no-such-compiler")
    inputs = readings(BLOCKS["lee2012"], 50)
    with pytest.warns(UserWarning, match="interpreter.*no C compiler: 'no-such-compiler' is not installed"):
        result = running.run(BLOCKS["lee2012"], inputs)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        again = running.run(BLOCKS["lee2012"], inputs)
    assert np.array_equal(result["roll"], interpreted.run(BLOCKS["lee2012"], inputs)["roll"])
    assert np.array_equal(result["roll"], again["roll"])


@needs_compiler
@pytest.mark.parametrize(("what", "mode"), [("file", 0o620), ("file", 0o602), ("folder", 0o720), ("folder", 0o702)])
def test_a_library_that_others_can_write_is_not_loaded(what: str, mode: int, fresh: Path) -> None:
    inputs = readings(BLOCKS["rizun2008"], 50)
    running.run(BLOCKS["rizun2008"], inputs)
    (kept,) = fresh.rglob(f"rizun2008{library._SUFFIX}")
    (kept if what == "file" else kept.parent).chmod(mode)
    library._loaded.cache_clear()
    with pytest.warns(UserWarning, match="belongs to others or can be written by them; delete it"):
        result = running.run(BLOCKS["rizun2008"], inputs)
    assert np.array_equal(result["roll"], interpreted.run(BLOCKS["rizun2008"], inputs)["roll"])


@needs_compiler
def test_a_kept_library_that_was_damaged_is_compiled_again(fresh: Path) -> None:
    inputs = readings(BLOCKS["rizun2008"], 50)
    running.run(BLOCKS["rizun2008"], inputs)
    (kept,) = fresh.rglob(f"rizun2008{library._SUFFIX}")
    whole = kept.read_bytes()
    damaged = kept.with_name("damaged")
    damaged.write_bytes(whole[: len(whole) // 2])
    damaged.replace(kept)  # the file that is loaded stays as it is
    for known in (library.compiled, library._loaded):
        known.cache_clear()
    result = running.run(BLOCKS["rizun2008"], inputs)
    assert np.array_equal(result["roll"], interpreted.run(BLOCKS["rizun2008"], inputs)["roll"])
    assert len(kept.read_bytes()) == len(whole)


@needs_compiler
def test_a_library_that_is_kept_serves_short_runs_too_and_none_but_its_own_block(
    fresh: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    running.run(MIRROR, readings(MIRROR, 20))
    library.compiled.cache_clear()
    monkeypatch.setattr(library, "_ROWS_FOR_A_COMPILATION", 10**9)
    assert library.compiled(MIRROR).library(1) is not None
    other = replace(MIRROR, step=lambda x, u, p: vars(x) | dict(sum=x.sum - u.scalar))
    assert library.compiled(other).library(1) is None


def test_where_nothing_can_be_kept_the_interpreter_serves(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (fresh / "file").write_text("")
    monkeypatch.setattr(library, "user_cache_path", lambda _name: fresh / "file")
    inputs = readings(MIRROR, 20)
    with pytest.warns(UserWarning, match="blocks run in CasADi's interpreter"):
        result = running.run(MIRROR, inputs)
    assert np.array_equal(result["sum"], interpreted.run(MIRROR, inputs)["sum"], equal_nan=True)


@needs_compiler
def test_a_short_run_compiles_nothing(fresh: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library, "_ROWS_FOR_A_COMPILATION", 1000)
    for _ in range(3):
        running.run(BLOCKS["lee2012"], readings(BLOCKS["lee2012"], 300))
    assert not list(fresh.rglob("lee2012*"))
    running.run(BLOCKS["lee2012"], readings(BLOCKS["lee2012"], 300))  # 1196 rows behind first samples by now
    assert list(fresh.rglob("lee2012*"))
