"""The modelDescription.xml of a block, for both kinds of FMU: in Python and native.

They differ in what the native one adds: its sources, and derivatives of its outputs.
"""

from __future__ import annotations

import hashlib
import uuid
from collections.abc import Iterable
from xml.etree.ElementTree import Element, SubElement, tostring

import casadi as ca
import numpy as np

from .. import __version__
from ..blocks import vocabulary
from ..blocks.block import Block, ContinuousBlock, SampledBlock, Variable
from ..blocks.signals import UNITS, Parameter

_NAMESPACE = uuid.UUID("7b0c9d52-4a0e-5c8e-9a53-3f6d8f0f7c11")  # of imufmu's GUIDs; any fixed value serves
_STOP_TIME = 10.0
NATIVE_SOURCE = "fmu.c"  # includes all others
_PLANT_STEP = 0.01
_TOLERANCE = 1e-6  # for hosts with a solver of their own, some of which warn without one; the FMUs have fixed steps

# Of what fmi2GetDirectionalDerivative of a sampled block is the derivative, for those who write importers.
DERIVATIVE_OF_SAMPLED = (
    "Outputs are held between samples. At a communication point no output depends on the inputs in force, so none is "
    "declared to: there is no feed-through. fmi2GetDirectionalDerivative answers another question: how the outputs of "
    "the last sample would have changed with the inputs of that sample. During initialisation that is the first sample."
)

LOG_CATEGORIES = {
    "logStatusWarning": "Missing inputs",
    "logStatusError": "Refused calls, steps and parameter values",
    "logStatusFatal": "The FMU cannot go on",
    "logAll": "Every message",
}


def value_references(block: Block) -> list[tuple[int, Variable]]:
    """Value reference and variable in the order of the XML: inputs, parameters, outputs, locals."""
    listed = list(enumerate(block.variables))
    if isinstance(block, SampledBlock):
        clock = Variable(vocabulary.SAMPLE_TIME.name, vocabulary.SAMPLE_TIME, "output", -1, 0.0)
        last_output = max(i for i, v in listed if v.group == "output")
        listed.insert(last_output + 1, (len(listed), clock))
    return listed


def guid(block: Block, *, native: bool = False) -> str:
    """GUID that follows from the declaration alone: interface and equations. Each kind of FMU has its own."""
    digest = hashlib.sha256(tostring(_description(block, "", native)))
    for function in _functions(block):
        digest.update(function.serialize().encode())
    return f"{{{uuid.uuid5(_NAMESPACE, digest.hexdigest())}}}"


def model_description(block: Block, *, native: bool = False) -> Element:
    """Root element of modelDescription.xml."""
    return _description(block, guid(block, native=native), native)


def _functions(block: Block) -> list[ca.Function]:
    if isinstance(block, SampledBlock):
        return [block.first_function, block.next_function]
    assert isinstance(block, ContinuousBlock)
    return [block.initial_function, block.advance_function, block.output_function]


def _description(block: Block, identity: str, native: bool) -> Element:
    root = Element(
        "fmiModelDescription",
        fmiVersion="2.0",
        modelName=block.name,
        guid=identity,
        description=block.summary,
        version=__version__,
        license="MIT",
        generationTool=f"imufmu {__version__}",
        variableNamingConvention="structured",
    )
    slave = SubElement(
        root,
        "CoSimulation",
        modelIdentifier=block.name,
        needsExecutionTool="false",
        canHandleVariableCommunicationStepSize="true",
        canInterpolateInputs="false",
        canBeInstantiatedOnlyOncePerProcess="false",
        canNotUseMemoryManagementFunctions="true",
        canGetAndSetFMUstate="true",
        canSerializeFMUstate="true",
        providesDirectionalDerivative="true" if native else "false",
    )
    if native:
        SubElement(SubElement(slave, "SourceFiles"), "File", name=NATIVE_SOURCE)
    listed = value_references(block)
    _units(root, {variable.signal.unit for _, variable in listed if variable_type(variable) == "Real"})
    categories = SubElement(root, "LogCategories")
    for name, description in LOG_CATEGORIES.items():
        SubElement(categories, "Category", name=name, description=description)
    step = block.period if isinstance(block, SampledBlock) else _PLANT_STEP
    times = {"startTime": "0", "stopTime": f"{_STOP_TIME:g}", "stepSize": _number(step)}
    SubElement(root, "DefaultExperiment", times, tolerance=_number(_TOLERANCE))
    if native and isinstance(block, SampledBlock):
        tool = SubElement(SubElement(root, "VendorAnnotations"), "Tool", name="imufmu")
        SubElement(tool, "DirectionalDerivative").text = DERIVATIVE_OF_SAMPLED
    variables = SubElement(root, "ModelVariables")
    for reference, variable in listed:
        _scalar_variable(variables, block, reference, variable)
    _structure(root, block, [variable for _, variable in listed])
    return root


def _units(root: Element, used: Iterable[str]) -> None:
    definitions = SubElement(root, "UnitDefinitions")
    for name in sorted(used):
        unit = UNITS[name]
        element = SubElement(definitions, "Unit", name=name)
        if unit.base is not None:
            factor = {} if unit.factor == 1.0 else {"factor": _number(unit.factor)}
            SubElement(element, "BaseUnit", {base: str(power) for base, power in unit.base.items()} | factor)
        if unit.display:
            SubElement(element, "DisplayUnit", name=unit.display[0], factor=_number(unit.display[1]))


def variable_type(variable: Variable) -> str:
    """Real, Integer or Boolean."""
    signal = variable.signal
    return signal.kind.capitalize() if isinstance(signal, Parameter) else "Real"


def _scalar_variable(parent: Element, block: Block, reference: int, variable: Variable) -> None:
    signal = variable.signal
    attributes = {"name": variable.name, "valueReference": str(reference), "description": signal.description}
    if isinstance(signal, Parameter):
        variability = "tunable" if signal.tunable else "fixed"
        attributes |= {"causality": "parameter", "variability": variability, "initial": "exact"}
    elif variable.group == "input":
        attributes |= {"causality": "input", "variability": "continuous"}
    else:
        variability = "discrete" if isinstance(block, SampledBlock) else "continuous"
        attributes |= {"causality": variable.group, "variability": variability, "initial": "calculated"}
    element = SubElement(parent, "ScalarVariable", attributes)
    has_start = variable.group in ("input", "parameter")
    match variable_type(variable):
        case "Real":
            unit = UNITS[signal.unit]
            shown = {"displayUnit": unit.display[0]} if unit.display else {}
            bounds = {"min": _number(signal.minimum), "max": _number(signal.maximum)}
            start = {"start": _number(variable.start)} if has_start else {}
            SubElement(
                element, "Real", {"unit": signal.unit} | shown | bounds | {"nominal": _number(signal.nominal)} | start
            )
        case "Integer":
            bounds = {"min": f"{signal.minimum:.0f}", "max": f"{signal.maximum:.0f}"}
            SubElement(element, "Integer", bounds | {"start": f"{variable.start:.0f}"})
        case "Boolean":
            SubElement(element, "Boolean", start=str(bool(variable.start)).lower())


def _structure(root: Element, block: Block, listed: list[Variable]) -> None:
    """Outputs and InitialUnknowns with their dependencies, from the sparsity of the Functions."""
    position = {variable.name: i + 1 for i, variable in enumerate(listed)}
    inputs = [position[v.name] for v in block.variables if v.group == "input"]
    parameters = [position[v.name] for v in block.variables if v.group == "parameter"]
    on_inputs, initially_on_inputs, initially_on_parameters = _dependencies(block)
    structure = SubElement(root, "ModelStructure")
    outputs = SubElement(structure, "Outputs")
    initial = SubElement(structure, "InitialUnknowns")
    for variable in listed:
        if variable.group != "output":
            continue
        index = str(position[variable.name])
        now: list[int] = []
        at_start: list[int] = []
        if variable.index >= 0:  # sample_time follows from the start time alone
            now = [inputs[j] for j in np.flatnonzero(on_inputs[variable.index])]
            at_start = [inputs[j] for j in np.flatnonzero(initially_on_inputs[variable.index])]
            at_start += [parameters[j] for j in np.flatnonzero(initially_on_parameters[variable.index])]
        SubElement(outputs, "Unknown", index=index, dependencies=" ".join(map(str, now)))
        SubElement(initial, "Unknown", index=index, dependencies=" ".join(map(str, sorted(at_start))))


def _dependencies(block: Block) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Boolean matrices: outputs on inputs while stepping, then at the start on inputs and on parameters.

    The outputs of a sampled block are held between samples: setting an input changes none of them.
    """
    if isinstance(block, SampledBlock):
        function = block.first_function
        at_start = _pattern(function, 0), _pattern(function, 1)
        return np.zeros_like(at_start[0]), *at_start
    assert isinstance(block, ContinuousBlock)
    u, p = ca.SX.sym("u", block.output_function.numel_in(1)), ca.SX.sym("p", block.output_function.numel_in(2))
    t, w = ca.SX.sym("t"), ca.SX.sym("w", block.normals)
    y = block.output_function(block.initial_function(p, w), u, p, t)
    function = ca.Function("start", [u, p, t, w], [y])
    return _pattern(block.output_function, 1), _pattern(function, 0), _pattern(function, 1)


def _pattern(function: ca.Function, argument: int) -> np.ndarray:
    """Which elements of the last result depend on which elements of an argument."""
    sparsity = function.jac_sparsity(function.n_out() - 1, argument)
    return np.array(ca.DM(sparsity, 1)) != 0


def _number(value: float) -> str:
    """Shortest text that reads back as the same double."""
    return repr(float(value))
