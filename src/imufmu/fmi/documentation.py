"""What a user reads about a block: tables of its signals and parameters, the FMU's documentation page, its icon."""

from __future__ import annotations

import inspect
import io
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined

from .. import __version__
from ..blocks.block import Block, SampledBlock
from ..blocks.series import Series
from ..blocks.signals import Parameter, Signal
from .datasheet import rule_for, sheet_rows
from .prose import paragraphs, section, words


def signal_rows(signals: tuple[Signal, ...]) -> list[dict[str, str]]:
    """One row per signal or parameter: name with its index range, unit, start, bounds, description."""
    rows = []
    for signal in signals:
        index = f"[{','.join(f'1..{n}' for n in signal.shape)}]" if signal.shape else ""
        starts = dict.fromkeys(f"{value:.6g}" for value in signal.start_values())  # in order, without repetition
        start = next(iter(starts)) if len(starts) == 1 else ", ".join(f"{v:.6g}" for v in signal.start_values())
        rows.append(
            {
                "name": signal.name + index,
                "unit": signal.unit,
                "start": start,
                "range": f"{signal.minimum:.6g} to {signal.maximum:.6g}",
                "description": signal.description,
                "tunable": "yes" if isinstance(signal, Parameter) and signal.tunable else "no",
            }
        )
    return rows


def modules(block: Block) -> list[tuple[str, str]]:
    """Names and docstrings of the module of the block, with its equations, symbols and source, and of those it names.

    A name with an underscore, or behind the word "module", is one where such a module of the same room is loaded; where
    the block has a folder of its own, so is every word that a module there is called by.
    """
    module = inspect.getmodule(block.output)
    if module is None:
        return []
    folder = module.__name__.rpartition(".")[0]
    room = ".".join(folder.split(".")[:2])
    text = inspect.cleandoc(module.__doc__ or "")
    names = re.findall(r"\b[a-z]\w*_\w+|(?<=\bmodule )[a-z]\w*", text)
    own = re.findall(r"\b[a-z]\w*", text) if folder != room else []
    wanted = dict.fromkeys([*(f"{folder}.{name}" for name in own), *(f"{room}.{name}" for name in names)])
    parts = [sys.modules[name] for name in wanted if name in sys.modules and name != module.__name__]
    found = [(part.__name__.rpartition(".")[2], inspect.cleandoc(part.__doc__ or "")) for part in parts]
    return [(block.name, text), *found]


def documentation_page(block: Block, platforms: Sequence[str] = ()) -> str:
    """HTML page of the block's FMU. platforms: those of a native FMU; none for the Python FMU."""
    environment = Environment(loader=PackageLoader("imufmu.fmi"), autoescape=True, undefined=StrictUndefined)
    parts = block.blocks if isinstance(block, Series) else (block,)
    names = {signal.name for part in parts for signal in (*part.inputs, *part.parameters, *part.reported)}

    def drawn(text: str) -> str:
        return "\n".join(f"<p>{words(paragraph, names)}</p>" for paragraph in paragraphs(text))

    return environment.get_template("documentation.html").render(
        block=block,
        platforms=platforms,
        version=__version__,
        sampled=isinstance(block, SampledBlock),
        what=[(part.name, drawn(part.doc)) for part in parts],
        when=drawn(parts[-1].when),
        reference=words(block.reference),
        equations={name: section(text, names) for part in parts for name, text in modules(part)},
        sheet=sheet_rows(block),
        has_variance=any(signal.unit == "rad2/s2" and rule_for(signal) for signal in block.parameters),
        needs_bias_removed=isinstance(block, SampledBlock) and not any("bias" in name for name in names),
        tables={
            "Inputs": signal_rows(block.inputs),
            "Parameters": signal_rows(block.parameters),
            "Outputs": signal_rows(block.outputs),
            "Local variables": signal_rows(block.locals),
        },
    )


def write_documentation(block: Block, folder: Path) -> None:
    """Write index.html of the Python FMU into a new folder."""
    folder.mkdir()
    (folder / "index.html").write_text(documentation_page(block), encoding="utf-8")


def icon(name: str) -> bytes:
    """PNG of an artificial horizon above the block's name."""
    from matplotlib.figure import Figure  # takes long to load, and most who read about a block want no icon
    from matplotlib.patches import Circle

    figure = Figure(figsize=(1.28, 1.28), dpi=100)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set(xlim=(-1, 1), ylim=(-1.25, 0.75), aspect="equal")
    rim = Circle((0, 0.05), 0.62, facecolor="#9cc4e4", edgecolor="#26323f", linewidth=2)
    axes.add_patch(rim)
    ground = axes.fill([-1, 1, 1, -1], [-0.12, 0.22, -1, -1], color="#9b7653")[0]
    ground.set_clip_path(rim)
    axes.plot([-0.35, -0.12, 0, 0.12, 0.35], [0.05, 0.05, -0.05, 0.05, 0.05], color="#f2b705", linewidth=2.5)
    axes.text(0, -0.98, name, ha="center", va="center", fontsize=max(5.0, 10.5 - 0.28 * len(name)), color="#26323f")
    image = io.BytesIO()
    figure.savefig(image, format="png", metadata={"Software": None})
    return image.getvalue()
