"""Claims about declarations: what is refused, how vectors and matrices flatten, what a block sees of its inputs."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest

from imufmu.blocks.block import ParameterError
from imufmu.blocks.running import run, simulate
from imufmu.blocks.signals import UNITS, DeclarationError, Parameter, Signal, integer, real, switch
from support.toys import GAIN, LAZY, MIRROR, OSCILLATOR, signal

# Declarations


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (("a", "furlong", "d", 0, 1), "a: unit 'furlong'"),
        (("2a", "1", "d", 0, 1), "'2a' is not a variable name"),
        (("", "1", "d", 0, 1), "'' is not a variable name"),
        (("a b", "1", "d", 0, 1), "'a b' is not a variable name"),
        (("a", "1", "", 0, 1), "a: description missing"),
        (("a", "1", "d", 1, 2), r"a: start 0.0 outside \[1, 2\]"),
        (("a", "1", "d", math.nan, 2), "a: start 0.0 outside"),
        (("a", "1", "d", 0, 1, (3,), (0.5, 0.5)), "a: 2 start values for 3 elements"),
        (("a", "1", "d", 0, 1, (3,), (0.5, 0.5, 7.0)), "a: start 7.0 outside"),
        (("a", "1", "d", 0, 1, (2, 2, 2)), r"a: shape \(2, 2, 2\) is not that of a scalar, vector or matrix"),
        (("a", "1", "d", 0, 1, (0,)), r"a: shape \(0,\) is not"),
    ],
)
def test_a_wrong_signal_is_refused_by_name(arguments: tuple[Any, ...], complaint: str) -> None:
    with pytest.raises(DeclarationError, match=complaint):
        Signal(*arguments)


def test_only_real_parameters_carry_a_unit() -> None:
    with pytest.raises(DeclarationError, match="n: only real"):
        Parameter("n", "s", "d", 0, 1, kind="integer")


def test_a_name_declared_twice_is_refused() -> None:
    twice = replace(MIRROR, outputs=(*MIRROR.outputs, signal("scalar")))
    with pytest.raises(DeclarationError, match="mirror: declared twice: scalar"):
        _ = twice.variables


def test_parameter_kinds_carry_their_bounds() -> None:
    assert real("x", "s", (0.0, -3.0), (-5, 5), "d", shape=(2,)).nominal == 3.0
    assert real("x", "s", 0.0, (-5, 5), "d").nominal == 1.0
    assert (integer("n", 2, (1, 3), "d").kind, switch("f", "d", start=True).start_values()) == ("integer", (1.0,))


def test_units_that_si_can_express_have_a_base() -> None:
    assert [name for name, unit in UNITS.items() if unit.base is None] == [name for name in UNITS if "sqrt" in name]


# What functions return


@pytest.mark.parametrize("what", ["initial", "step", "output"])
def test_a_function_that_returns_other_names_is_refused(what: str) -> None:
    changes: dict[str, Any] = {what: lambda *_: dict(samples=1, extra=2)}
    wrong = replace(MIRROR, **changes)
    with pytest.raises(DeclarationError, match=rf"mirror\.{what} must return \[.*\], returned \['extra', 'samples'\]"):
        run(wrong, {"scalar": [1.0, 2.0]})


@pytest.mark.parametrize("what", ["initial", "dynamics", "output"])
def test_a_continuous_function_that_returns_other_names_is_refused(what: str) -> None:
    changes: dict[str, Any] = {what: lambda *_: dict(q=1)}
    wrong = replace(OSCILLATOR, **changes)
    with pytest.raises(DeclarationError, match=rf"oscillator\.{what} must return .* returned \['q'\]"):
        simulate(wrong, 1.0, 0.1)


@pytest.mark.parametrize(("value", "shape"), [(1.0, r"\(1, 1\)"), (np.ones((3, 2)), r"\(3, 2\)")])
def test_a_result_of_another_shape_is_refused_by_name(value: Any, shape: str) -> None:
    """A transposed matrix too: it has the right number of elements in the wrong places."""
    wrong = replace(MIRROR, initial=lambda u, p: dict(samples=1, sum=0, product=value))
    with pytest.raises(DeclarationError, match=rf"mirror\.initial: product has shape {shape}, not \(2, 3\)"):
        run(wrong, {"scalar": [1.0]})


def test_a_slow_step_or_a_step_beside_it_that_returns_other_names_is_refused() -> None:
    with pytest.raises(DeclarationError, match=r"lazy\.slow_steps\[0\] must return \[.*\], returned \[.*'extra'.*\]"):
        run(replace(LAZY, slow_steps=(lambda *_: dict(extra=1),)), {"scalar": [1.0, 2.0]})
    # The step changes the states declared first: sum without samples is not a beginning.
    with pytest.raises(DeclarationError, match=r"lazy\.step must return \['samples'\], returned \['sum'\]"):
        run(replace(LAZY, step=lambda *_: dict(sum=1)), {"scalar": [1.0, 2.0]})


@pytest.mark.parametrize("half", [{"slow_due": None}, {"slow_steps": ()}])
def test_half_a_slow_step_is_refused(half: dict[str, Any]) -> None:
    with pytest.raises(DeclarationError, match="lazy: declare both of slow_due and slow_steps, or neither"):
        replace(LAZY, **half)


@pytest.mark.parametrize("number", [1, 2])
def test_a_slow_step_stands_behind_a_switch_that_skips_it(number: int) -> None:
    """CasADi evaluates only the chosen branch of a Switch; generated C has a switch there."""
    graph = LAZY.next_function
    assert not any("slow_step" in name for name in graph.get_function())
    assert graph.get_function("lazy_slow").class_name() == "Switch"
    code = ca.CodeGenerator("lazy", {"with_header": False})
    code.add(graph)
    text = str(code.dump())
    name = re.search(rf"/\* lazy_slow_step_{number}:.*\*/\s*static int (\w+)", text)
    assert name is not None
    assert re.findall(r"(.*)\n.*" + name[1] + r"\(arg\+1", text) == [f"    case {number}:"]


def test_a_block_without_a_slow_step_is_one_list_of_instructions() -> None:
    assert MIRROR.next_function.is_a("SXFunction")


@pytest.mark.parametrize("changed", ["samples", "sum", "product"])
def test_the_step_beside_a_slow_step_may_change_any_beginning_of_the_state(changed: str) -> None:
    names = ["samples", "sum", "product"]
    first = names[: names.index(changed) + 1]
    block = replace(LAZY, step=lambda x, u, p: {name: 1 + getattr(x, name) for name in first}, slow_due=lambda *_: 0)
    seen = run(block, {"scalar": np.zeros(4)})
    assert [name for name in names if np.all(seen[name][3] - seen[name][0] == 3)] == first


# Flat vectors


def test_elements_are_named_row_by_row() -> None:
    assert signal("P", (2, 2)).element_names() == ["P[1,1]", "P[1,2]", "P[2,1]", "P[2,2]"]
    assert signal("v", (2,)).element_names() == ["v[1]", "v[2]"]
    assert signal("s").element_names() == ["s"]


def test_variables_are_the_flat_vectors_in_order() -> None:
    """Locals follow the outputs in one vector; every other group has a vector of its own."""
    groups = [(v.group, v.index) for v in MIRROR.variables]
    inputs, parameters, reported = 3 + 1 + 6, 1 + 1 + 6 + 3 + 1 + 1, 3 + 3 + 1 + 1 + 6 + 6 + 2 + 1 + 1 + 6 + 6
    assert [i for group, i in groups if group == "input"] == list(range(inputs))
    assert [i for group, i in groups if group == "parameter"] == list(range(parameters))
    assert [i for group, i in groups if group in ("output", "local")] == list(range(reported))
    by_name = {v.name: v for v in MIRROR.variables}
    assert by_name["gain[2,1]"].start == 4.0
    assert by_name["vector[3]"].start == 0.3


def test_matrices_survive_the_flat_vectors() -> None:
    """Parameter, input, state and output: what goes in row by row comes out row by row."""
    matrix = np.arange(6.0).reshape(2, 3)
    result = run(MIRROR, {"matrix": np.stack([matrix, 2 * matrix, 3 * matrix])})
    assert np.array_equal(result["gain_seen"][0], GAIN)
    assert np.array_equal(result["matrix_seen"][1], 2 * matrix)
    assert np.array_equal(result["matrix_before"][1], matrix)
    assert np.allclose(result["product"][2], np.array(GAIN) + 0.1 * 5 * matrix, rtol=1e-15)  # one rounding a sum


# Parameters


def parameter(p: np.ndarray, name: str) -> float:
    return float(p[[v.name for v in MIRROR.variables if v.group == "parameter"].index(name)])


def test_parameters_are_set_whole_or_by_element() -> None:
    p = MIRROR.parameter_vector({"mount": (0.1, 0.2, 0.3), "mount[2]": -1, "gain[2,1]": 9, "mode": 3, "flag": True})
    assert [parameter(p, f"mount[{i}]") for i in (1, 2, 3)] == [0.1, -1.0, 0.3]
    assert [parameter(p, name) for name in ("gain[1,1]", "gain[2,1]", "mode", "flag")] == [1, 9, 3, 1]
    p = MIRROR.parameter_vector({"gain": np.ones((2, 3)), "mount": 0.5, "seed": 5})
    assert [parameter(p, name) for name in ("gain[2,3]", "mount[3]", "seed")] == [1, 0.5, 5]


def test_no_parameters_means_the_start_values() -> None:
    assert np.array_equal(MIRROR.parameter_vector(), MIRROR.parameter_vector({}))
    assert parameter(MIRROR.parameter_vector(), "sample_period") == 0.01


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        ({"speed": 1}, "speed: unknown; mirror has sample_period, seed, gain, mount, mode, flag"),
        ({"mount": (1, 2)}, "mount: 2 values for 3 elements"),
        ({"mount": 4}, r"mount\[1\] = 4 rad is outside \[-3, 3\] rad"),
        ({"mount[2]": -4}, r"mount\[2\] = -4 rad is outside"),
        ({"mode": 1.5}, "mode = 1.5 is not a whole number"),
        ({"flag": 0.5}, "flag = 0.5 is not a whole number"),
        ({"mode": 7}, r"mode = 7 is outside \[1, 3\]"),
        ({"mode": math.nan}, r"mode = nan is outside \[1, 3\]"),
        ({"mode": math.inf}, r"mode = inf is outside \[1, 3\]"),
        ({"mode": None}, "mode = nan is outside"),
        ({"mode": "fast"}, "mode: 'fast' is not a number"),
        ({"sample_period": 0}, "sample_period = 0 s is outside"),
    ],
)
def test_a_wrong_parameter_is_refused_with_name_value_and_range(values: dict[str, Any], complaint: str) -> None:
    with pytest.raises(ParameterError, match=f"mirror: {complaint}"):
        MIRROR.parameter_vector(values)


def test_all_wrong_parameters_are_named_at_once() -> None:
    with pytest.raises(ParameterError) as refusal:
        MIRROR.parameter_vector({"speed": 1, "mount": (1, 2), "mode": 9, "flag": 2})
    assert all(name in str(refusal.value) for name in ("speed", "mount", "mode", "flag"))


# Missing inputs


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e200])
@pytest.mark.parametrize("element", [0, 1, 2])
def test_one_bad_element_holds_the_whole_last_finite_vector(bad: float, element: int) -> None:
    vector = np.arange(12.0).reshape(4, 3)
    vector[1:3, element] = bad
    seen = run(MIRROR, {"vector": vector, "scalar": np.ones(4)})
    assert np.array_equal(seen["vector_missing"], [0, 1, 1, 0])
    assert np.array_equal(seen["vector_seen"], vector[[0, 0, 0, 3]])
    assert np.array_equal(seen["vector_before"][1:], vector[[0, 0, 0]])
    assert np.array_equal(seen["scalar_missing"], np.zeros(4))
    assert np.array_equal(seen["sum"], [1, 2, 3, 4])


def test_before_the_first_finite_vector_the_start_value_holds() -> None:
    vector = np.array([[1, math.nan, 3], [math.nan] * 3, [4, 5, 6], [7, 8, 9]])
    seen = run(MIRROR, {"vector": vector})
    start = [0.1, 0.2, 0.3]
    assert np.array_equal(seen["vector_seen"], [start, start, vector[2], vector[3]])
    assert np.array_equal(seen["vector_before"], [start, start, start, vector[2]])
    assert np.array_equal(seen["vector_missing"], [1, 1, 0, 0])


def test_a_plant_holds_its_inputs_too() -> None:
    held = simulate(OSCILLATOR, 1.0, 0.1, {"force": [math.nan] * 2 + [1.0] * 3 + [math.inf] * 6})
    equal = simulate(OSCILLATOR, 1.0, 0.1, {"force": [0.0] * 2 + [1.0] * 9})
    assert np.array_equal(held["position"], equal["position"])
    assert np.array_equal(held["force_seen"], equal["force_seen"])


def test_ordinary_values_pass_unchanged_even_subnormal_ones() -> None:
    vector = np.array([[5e-324, -1e-300, 1e29], [-0.5, 0.0, 1 / 3]])
    seen = run(MIRROR, {"vector": vector})
    assert np.array_equal(seen["vector_seen"], vector)
    assert not seen["vector_missing"].any()


def test_a_term_that_several_equations_write_is_computed_once() -> None:
    once = replace(MIRROR, step=lambda x, u, p: dict(samples=1, sum=sine(u) + sine(u), product=sine(u) * p.gain))
    f = once.next_function
    assert sum(f.instruction_id(i) == ca.OP_SIN for i in range(f.n_instructions())) == 1


def sine(u: Any) -> Any:
    """A new expression at every call."""
    return ca.sin(u.scalar)
