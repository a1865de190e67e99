"""The verb ``imufmu list``."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from .console import Json, print_entries, print_json


@dataclass(frozen=True)
class Entry:
    """One thing there is. file: of a system or device, for use in systems of one's own."""

    kind: str
    name: str
    summary: str
    file: str | None = None


def list_(json: Json = False) -> None:
    """What there is: blocks, systems, devices.

    \b
      imufmu list
      imufmu list --json        also tells the files of systems and devices
    """
    entries = _blocks() + _files()
    if json:
        print_json([asdict(entry) for entry in entries])
    else:
        print_entries([[entry.kind, entry.name, entry.summary] for entry in entries])


def _blocks() -> list[Entry]:
    from ..registry import DELAYED, ESTIMATORS, PLANTS, SENSORS

    kinds = (("estimator", (*ESTIMATORS, *DELAYED)), ("sensor", SENSORS), ("plant", PLANTS))
    return [Entry(kind, block.name, block.summary) for kind, blocks in kinds for block in blocks]


def _files() -> list[Entry]:
    from ..cosim.description import read_description
    from ..cosim.ssp.files import read_xml
    from ..files.locations import models_folder

    entries = []
    for path in sorted(models_folder().rglob("*.ssd")):
        entries.append(Entry("system", path.stem, read_description(path).description, str(path)))
    for path in sorted((models_folder() / "imus").glob("*.ssv")):
        parameters = read_xml(path, "ParameterSet")
        entries.append(Entry("device", path.stem, parameters.get("description", parameters.get("name")), str(path)))
    return entries
