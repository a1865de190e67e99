"""The rooms of src/imufmu and which way they look: each imports from rooms below it only."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

from support.places import ROOT

SOURCE = ROOT / "src"

# From top to bottom; the rooms of one line do not see each other.
ORDER = (
    ("cli",),
    ("gate",),
    ("benchmarks",),
    ("papers",),
    ("reports",),
    ("pictures",),
    ("scoring",),
    ("cosim",),
    ("fmi",),
    ("compiled",),
    ("registry",),
    ("estimators", "sensors", "plants"),
    ("recordings",),
    ("blocks",),
    ("files",),
)
LEVEL = {room: level for level, rooms in enumerate(reversed(ORDER)) for room in rooms}
MODULES = {
    ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__"): path
    for path in sorted((SOURCE / "imufmu").rglob("*.py"))
}


def room_of(module: str) -> str:
    """estimators of imufmu.estimators.plumb.filter; empty for imufmu itself, the face, and python -m imufmu."""
    return "" if module in ("imufmu", "imufmu.__main__") else module.split(".")[1]


def imports(module: str) -> Iterator[str]:
    """Modules of ours that a module imports, also inside its functions."""
    path = MODULES[module]
    package = module.split(".") if path.name == "__init__.py" else module.split(".")[:-1]
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names if alias.name.split(".")[0] == "imufmu")
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) - node.level + 1] if node.level else []
            target = ".".join([*above, *([node.module] if node.module else [])])
            for name in (alias.name for alias in node.names):
                yield f"{target}.{name}" if f"{target}.{name}" in MODULES else target


def ours(module: str) -> list[str]:
    return [name for name in imports(module) if name in MODULES and name != module]


def test_every_room_has_its_place() -> None:
    assert {room_of(module) for module in MODULES} == {"", *LEVEL}


@pytest.mark.parametrize("module", MODULES)
def test_a_room_looks_down_only(module: str) -> None:
    here = room_of(module)
    upwards = {
        name
        for name in ours(module)
        if here and room_of(name) not in ("", here) and LEVEL[room_of(name)] >= LEVEL[here]
    }
    assert not upwards


def test_no_module_imports_itself_by_way_of_others() -> None:
    # A package's __init__ that shows a module of its own is no circle: the module does not look back.
    TopologicalSorter({module: ours(module) for module in MODULES}).prepare()  # raises CycleError


def test_a_directory_is_no_room_without_a_docstring() -> None:
    silent = [name for name, path in MODULES.items() if not ast.get_docstring(ast.parse(path.read_text()))]
    assert not silent


def test_the_source_is_where_these_tests_look() -> None:
    assert Path(SOURCE / "imufmu" / "registry.py") in MODULES.values()
