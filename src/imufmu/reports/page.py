"""Self-contained HTML reports: no script, no link to anything outside the file."""

from __future__ import annotations

import base64
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.figure import Figure

from .. import __version__
from ..files.atomic import atomic_write
from ..pictures.figures import png
from ..scoring.table import Table


@dataclass(frozen=True)
class Section:
    """One part of a report; what is empty is left out.

    points: a list below the text. figure: to draw, or a PNG image. level: 2, or 3 for a part of the section before.
    """

    heading: str
    text: str = ""
    table: Table | None = None
    figure: Figure | bytes | None = None
    caption: str = ""
    points: Sequence[str] = ()
    level: int = 2


def write_report(path: Path, title: str, lead: str, sections: Sequence[Section]) -> None:
    """Write the page, whole or not at all. Raises WriteError."""
    environment = Environment(loader=PackageLoader("imufmu.reports"), autoescape=True, undefined=StrictUndefined)
    shown = [(section, base64.b64encode(_image(section.figure)).decode()) for section in sections]
    page = environment.get_template("page.html").render(
        title=title,
        lead=lead,
        sections=shown,
        made_with=f"imufmu {__version__}, Python {platform.python_version()}, CasADi {version('casadi')}, "
        f"FMPy {version('fmpy')}, {platform.system()} {platform.machine()}",
    )
    with atomic_write(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def _image(figure: Figure | bytes | None) -> bytes:
    return png(figure) if isinstance(figure, Figure) else figure or b""
