"""Wire a plant of others to an IMU and estimators without a line of XML: find what it offers, write the description.

What stays unclear is asked, or refused with all there is and the words to say it: nothing is guessed in silence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ...blocks.signals import Signal
from ...blocks.vocabulary import ACCEL, ANGULAR_VELOCITY, GYRO, MAG, MAGNETIC_FIELD, SPECIFIC_FORCE
from ...files.names import no_such
from ...fmi.archive import read_fmu
from ...registry import BLOCKS, ESTIMATORS
from ..devices import DeviceValue, device_values
from ..interface import Interface, WiringError
from ..truth import COMPONENT, PLANT, Told, derived_names, knows_attitude
from .description_xml import Part, Wire, written
from .matching import ALIASES, READ, SPEED, TOLD, Ask, Choice, Matcher, short, with_form

IMU, NO_IMU = "imu", "none"
_STOP = 10.0  # s, where neither the plant nor the user says
_PERIOD = 0.01  # s
_SENSORS = {"angular_velocity": (ANGULAR_VELOCITY, GYRO), "specific_force": (SPECIFIC_FORCE, ACCEL)}
_SENSORS |= {"magnetic_field": (MAGNETIC_FIELD, MAG)}


@dataclass
class Connected:
    """A description to be written, and what a user should know of it.

    name: of the system. found: what was taken for what. compared: what errors can be computed. notes: what was left out
    or assumed.
    """

    name: str
    found: list[str] = field(default_factory=list)
    compared: str = ""
    notes: list[str] = field(default_factory=list)
    _parts: list[Part] = field(default_factory=list)
    _wires: list[Wire] = field(default_factory=list)
    _truth: tuple[Told, ...] = ()
    _times: tuple[float, float, float] = (0.0, _STOP, _PERIOD)

    @property
    def lines(self) -> list[str]:
        """Everything that a user should read."""
        return [*self.found, self.compared, *self.notes]

    def text(self, folder: Path) -> bytes:
        """The description (SSP 1.0), to lie in a folder."""
        return written(self.name, self._parts, self._wires, self._truth, self._times, folder)


def connect(
    plant: str | Path,
    imu: str | Path = "mtx",
    estimators: Sequence[str | Path] = ("plumb",),
    mapping: Mapping[str, str] | None = None,
    *,
    rate: float | None = None,
    stop_time: float | None = None,
    ask: Ask | None = None,
) -> Connected:
    """Connect a plant to an IMU, and that to estimators.

    imu: a device, an .ssv file, "ideal", or "none" where the plant has sensors of its own. estimators: names or .fmu
    files. mapping: what is what, by gyro, accel, mag, vertical, roll, pitch, yaw, quaternion, matrix,
    external_acceleration, position, and forward_speed, of wheels, for plumb. It is a vector's name or its elements with
    commas, "-" for a turned sign, then behind colons a unit and, of a quaternion, order and direction:
    "q:xyzw:to-world". An input of an estimator's FMU: "component.gyro". rate: samples per second of everything. ask:
    answers a question with one of some texts.

    Raises ArchiveError, WiringError with everything that is unclear, and ValueError.
    """
    if rate is not None and not 0 < rate < 1e6:
        raise ValueError(f"rate = {rate:g}: expected samples per second, such as 200")
    path = Path(plant)
    faults: list[str] = []
    model = read_fmu(path, faults)
    given = _known_names({ALIASES.get(key, key): text for key, text in (mapping or {}).items()})
    result = Connected(path.stem, notes=faults)
    problems: list[str] = []
    outputs = _matcher(path.name, model, "output", "local")
    device = {} if str(imu) == NO_IMU else device_values(imu)
    period = 1.0 / rate if rate else float(device["sample_period"].text) if "sample_period" in device else _PERIOD
    read = _readings(outputs, given, ask, problems, result)
    result._parts.append(Part(PLANT, path.resolve(), {}))
    sources = {name: (PLANT, choice) for name, choice in read.items()}
    if str(imu) != NO_IMU:
        sources = _through_imu(result, sources, device, period, str(imu))
    if SPEED.name in given:
        speed = _given(outputs, SPEED.name, given[SPEED.name], problems)
        sources |= {SPEED.name: (PLANT, speed)} if speed else {}
        result.found += [f"{SPEED.name}: {speed}"] if speed else []
    for estimator in estimators:
        _add_estimator(result, estimator, sources, period, given, problems)
    problems += [
        f"--map {key}=...: there is no estimator {component!r}; there is {', '.join(p.name for p in result._parts[1:])}"
        for key in given
        for component in [key.rpartition(".")[0]]
        if component and component not in {part.name for part in result._parts[1:]}
    ]
    told = _truth(outputs, given, ask, problems, result)
    if problems:
        raise WiringError(path, problems, "cannot be connected by itself")
    _tell(result, told, read)
    experiment = model.defaultExperiment
    start = float(experiment.startTime or 0.0) if experiment else 0.0
    its_stop = float(experiment.stopTime) if experiment and experiment.stopTime else start + _STOP
    result._times = (start, its_stop if stop_time is None else stop_time, period)
    return result


def _known_names(given: dict[str, str]) -> dict[str, str]:
    known = {*READ, *TOLD, SPEED.name}
    for key in given:
        if key.rpartition(".")[2] not in {*known, *ALIASES}:
            raise ValueError(no_such("quantity", key, [*ALIASES, *sorted(known)]))
    return given


def _matcher(where: str, model: Any, causality: str, also: str = "") -> Matcher:
    """What variables of a causality can be; those of another one only where the user names them."""
    interface = Interface.of_model(where, model)
    variables = interface.of(causality, also)
    found = [v.name for v in variables if v.causality == causality]
    return Matcher(where, variables, {v.name: interface.unit(v) for v in variables}, found)


def _readings(
    outputs: Matcher, given: Mapping[str, str], ask: Ask | None, problems: list[str], result: Connected
) -> dict[str, Choice]:
    """What an IMU would read. Problems: what it needs and is not clear."""
    found = {}
    for name, quantity in READ.items():
        needed = name != "magnetic_field"
        if name in given:
            choice, why = _given(outputs, name, given[name], problems), ""
        else:
            choice, why = outputs.find(quantity, ask, by_unit=needed)
            if not choice and needed:
                nothing = f"nothing looks like {name}: say --map {short(name)}=...; there is {outputs.there_is(3)}"
                problems.append(why or nothing)
            elif not choice:
                result.notes.append(why or "no magnetic field in the plant: estimators go without a magnetometer")
        if choice:
            found[name] = choice
            result.found.append(f"{short(name)}: {choice}")
            if choice.unit is None:
                result.notes.append(f"{', '.join(choice.variables)} name no unit; taken for {quantity.unit}")
    return found


def _given(matcher: Matcher, name: str, text: str, problems: list[str]) -> Choice | None:
    try:
        return matcher.given({**READ, **TOLD, SPEED.name: SPEED}[name], text)
    except ValueError as error:
        problems.append(f"--map {error}")
        return None


def _through_imu(
    result: Connected,
    sources: Mapping[str, tuple[str, Choice]],
    device: Mapping[str, DeviceValue],
    period: float,
    name: str,
) -> dict[str, tuple[str, Choice]]:
    """The IMU between plant and estimators: its readings as sources."""
    values = dict(device) | {"sample_period": DeviceValue("Real", f"{period:.17g}", "s")}
    result._parts.append(Part(IMU, Path("imu.fmu"), values, f"IMU: {name}"))
    readings = {}
    for quantity, (component, choice) in sources.items():
        ideal, reading = _SENSORS[quantity]
        _wire(result, component, choice, IMU, ideal.element_names())
        readings[quantity] = (IMU, _exact(quantity, reading))
    return readings


def _exact(quantity: str, signal: Signal) -> Choice:
    return Choice(quantity, tuple(signal.element_names()), (1.0,) * signal.size, signal.unit)


def _wire(result: Connected, source: str, choice: Choice, target: str, names: Sequence[str]) -> None:
    for variable, factor, name in zip(choice.variables, choice.factors, names, strict=True):
        result._wires.append(Wire(source, variable, target, name, factor))


def _add_estimator(
    result: Connected,
    estimator: str | Path,
    sources: Mapping[str, tuple[str, Choice]],
    period: float,
    given: Mapping[str, str],
    problems: list[str],
) -> None:
    """An estimator behind the readings."""
    taken = {part.name for part in result._parts} | {COMPONENT}
    name = _free_name(Path(estimator).stem.replace(".", "_"), taken)
    inputs: dict[str, tuple[Sequence[str], tuple[float, ...]]] = {}
    if Path(estimator).suffix.lower() == ".fmu":
        path, model = Path(estimator).resolve(), read_fmu(Path(estimator), result.notes)
        matcher = _matcher(Path(estimator).name, model, "input")
        for quantity in READ:
            text = given.get(f"{name}.{quantity}") or given.get(f"{name}.{short(quantity)}")
            choice = _given(matcher, quantity, text, problems) if text else matcher.find(READ[quantity], None)[0]
            if choice:
                inputs[quantity] = choice.variables, choice.factors
        has_period = any(v.name == "sample_period" and v.causality == "parameter" for v in model.modelVariables)
        if SPEED.name in sources and any(v.name == SPEED.name and v.causality == "input" for v in model.modelVariables):
            choice = matcher.given(SPEED, SPEED.name)
            inputs[SPEED.name] = choice.variables, choice.factors
        lacking = [short(quantity) for quantity in READ if quantity not in inputs and quantity != "magnetic_field"]
        if lacking:
            problems.append(
                f"{matcher.where} has no input that looks like {' and '.join(lacking)}: "
                f"say --map {name}.{lacking[0]}=...; it has {matcher.there_is(3)}"
            )
    else:
        known = [block.name for block in ESTIMATORS]
        if str(estimator) not in known:
            raise ValueError(no_such("estimator", str(estimator), known, "or give an .fmu file"))
        path, has_period = Path(f"{estimator}.fmu"), True
        signals = {signal.name: signal for signal in BLOCKS[str(estimator)].inputs}
        for quantity, (_, reading) in _SENSORS.items():
            if reading.name in signals:
                inputs[quantity] = reading.element_names(), (1.0,) * reading.size
        if SPEED.name in signals:
            inputs[SPEED.name] = [SPEED.name], (1.0,)
        if not {"angular_velocity", "specific_force"} <= inputs.keys():
            problems.append(
                f"{estimator} takes {', '.join(signals)}: not the readings of one IMU; describe it in an .ssd"
            )
    values = {"sample_period": DeviceValue("Real", f"{period:.17g}", "s")} if has_period else {}
    if SPEED.name in sources and SPEED.name in inputs:
        values[f"{SPEED.name}_valid"] = DeviceValue("Real", "1", None)
    result._parts.append(Part(name, path, values))
    for quantity, (names, factors) in inputs.items():
        if quantity in sources:
            source, choice = sources[quantity]
            # A factor of an input is from its unit to ours: the way back.
            back = tuple(a / b for a, b in zip(choice.factors, factors, strict=True))
            _wire(result, source, Choice(quantity, choice.variables, back, choice.unit), name, names)


def _free_name(wanted: str, taken: set[str]) -> str:
    number, name = 1, wanted
    while name in taken:
        number += 1
        name = f"{wanted}_{number}"
    return name


def _truth(
    outputs: Matcher, given: Mapping[str, str], ask: Ask | None, problems: list[str], result: Connected
) -> dict[str, Choice]:
    """What the plant tells of its attitude; problems only with what the user has said."""
    found: dict[str, Choice] = {}
    for name in TOLD:
        choice = _given(outputs, name, given[name], problems) if name in given else outputs.find(TOLD[name], None)[0]
        if choice and (name not in ("quaternion", "matrix") or "to-" in choice.form):
            found[name] = choice
    for name in ("quaternion", "matrix"):  # where nothing else tells an attitude, one of them is worth a question
        if knows_attitude(found) or name in given:
            continue
        for candidate in outputs.candidates(TOLD[name]):
            choice, why = with_form(candidate, ask)
            if choice:
                found[name] = choice
                break
            if why:
                result.notes.append(why)
    return found


def _tell(result: Connected, told: Mapping[str, Choice], read: Mapping[str, Choice]) -> None:
    """Which truth there is, and what follows."""
    for name, choice in told.items():
        result.found.append(f"{name}: {choice}")
        if choice.unit is None and name not in ("quaternion", "matrix", "vertical"):
            result.notes.append(f"{', '.join(choice.variables)} names no unit; taken for {TOLD[name].unit}")
    if not knows_attitude(told):
        result.compared = (
            "no truth: the plant tells no vertical, no roll with pitch, and no quaternion or matrix whose order and "
            "direction are known; the run shows estimates, not errors"
        )
        return
    force = {"specific_force": read["specific_force"]} if "specific_force" in read else {}
    result._truth = tuple(
        Told(name, tuple(f"{PLANT}.{variable}" for variable in choice.variables), choice.factors, choice.form)
        for name, choice in {**told, **force}.items()
    )
    signals = dict.fromkeys(name.split(".")[1].split("[")[0] for name in derived_names(result._truth))
    errors = ["tilt, roll and pitch"]
    errors += ["yaw, where an estimator knows it"] if "yaw" in signals else []
    errors += ["external acceleration"] if "external_acceleration" in signals else []
    result.compared = f"truth: {', '.join(signals)}; compared: {', '.join(errors)}"
    if {"roll", "pitch"} <= told.keys() and not told.keys() & {"quaternion", "matrix", "vertical"}:
        result.notes.append("roll and pitch are taken for Z-Y-X angles against a z axis that points up")
