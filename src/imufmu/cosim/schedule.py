"""When each component of a system steps: in which phase of a tick, and in which order.

An FMU is sampled or continuous by what it does at a step, which FMI does not let it say. One with an output
``sample_time`` is sampled, as that tells for which instant its outputs are. Any other is continuous, as FMI has it: its
outputs after a step are those of the end of the step. A component may be marked in the description,

    <ssd:Annotations>
      <ssc:Annotation type="org.imufmu"><imufmu:Treat xmlns:imufmu="urn:imufmu:ssp" as="sampled"/></ssc:Annotation>
    </ssd:Annotations>

and a call may say so.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

from .interface import Interface, WiringError
from .order import Edge, signal_flow
from .ssp.flat import KINDS_OF_STEP
from .system import System

_TOLD = 3  # connections of a loop told by name


class Schedule:
    """The order of each phase of a tick, and of initialisation.

    treat: kinds of step by component. notes: what was assumed, and where loops are broken. Raises WiringError.
    """

    def __init__(self, system: System, jacobi: bool, treat: Mapping[str, str]) -> None:
        _check(system, treat)
        self.jacobi = jacobi
        self.notes: list[str] = []
        names = [part.name for part in system.parts]
        marked = {component.name: component.treat for component in system.description.components} | dict(treat)
        sampled = [name for name in names if self._is_sampled(system.interfaces[name], marked[name])]
        edges = {(link.source[0], link.target[0]) for link in system.links}
        self.initial, _ = signal_flow(names, edges)
        self.sampled, broken = signal_flow(sampled, edges)
        self.continuous, broken_too = signal_flow([name for name in names if name not in sampled], edges)
        if not jacobi:
            self.notes += _loops(system, [*broken, *broken_too])

    def _is_sampled(self, interface: Interface, marked: str | None) -> bool:
        if marked:
            return marked == "sampled"
        outputs = interface.of("output")
        if any(output.name == "sample_time" for output in outputs):
            return True
        if outputs and all(output.type != "Real" or output.variability == "discrete" for output in outputs):
            self.notes.append(
                f"{interface.component}: has discrete outputs and no sample_time; treated as continuous, its outputs "
                f"after a step are those of the end of the step. If they answer to the inputs of its beginning: "
                f"--treat {interface.component}=sampled"
            )
        return False


def _check(system: System, treat: Mapping[str, str]) -> None:
    problems = []
    for name, kind in treat.items():
        if name not in system.interfaces:
            problems.append(f"treat {name}: there is no such component; there is {', '.join(system.interfaces)}")
        if kind not in KINDS_OF_STEP:
            problems.append(f"treat {name} = {kind}: expected {' or '.join(KINDS_OF_STEP)}")
    if problems:
        raise WiringError(system.path, problems)


def _loops(system: System, broken: Collection[Edge]) -> list[str]:
    """One note for each pair of components whose connections are broken."""
    notes = []
    for edge in dict.fromkeys(broken):
        links = [str(link) for link in system.links if (link.source[0], link.target[0]) == edge]
        more = f" and {len(links) - _TOLD} more" if len(links) > _TOLD else ""
        carry = "carries the value" if len(links) == 1 else "carry the values"
        notes.append(f"loop of connections: {', '.join(links[:_TOLD])}{more} {carry} from before the step")
    return notes
