"""Moving pictures from a figure that changes: GIF by Pillow, MP4 by ffmpeg."""

from __future__ import annotations

import subprocess
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from ..files.atomic import atomic_write

GIF, MP4 = ".gif", ".mp4"
_COLOURS = 256  # of the palette that all frames of a GIF share
_SHADES = 8  # of a channel, of which the palette has one; Pillow looks colours up to within 4


def check_movie(path: Path) -> None:
    """Raises ValueError for a file that cannot be written here: another suffix, or MP4 without ffmpeg."""
    suffix = path.suffix.lower()
    if suffix not in (GIF, MP4):
        raise ValueError(f"{path}: cannot animate a {path.suffix or 'file without suffix'}; use {GIF} or {MP4}")
    if suffix == MP4 and not FFMpegWriter.isAvailable():
        raise ValueError(f"{path}: MP4 needs the program ffmpeg, which is not here: install ffmpeg or choose {GIF}")


def write_movie(path: Path, figure: Figure, frames: Iterable[object], rate: int) -> None:
    """Write a picture of the figure after every item of ``frames``, ``rate`` of them a second, whole or not at all.

    Raises WriteError, and ValueError as ``check_movie`` does and where ffmpeg fails.
    """
    check_movie(path)
    with atomic_write(path) as temporary:
        if path.suffix.lower() == GIF:
            _write_gif(temporary, figure, frames, rate)
        else:
            _write_mp4(temporary, path, figure, frames, rate)


def _write_gif(path: Path, figure: Figure, frames: Iterable[object], rate: int) -> None:
    canvas = FigureCanvasAgg(figure)
    palette: Image.Image | None = None
    images = []
    for _ in frames:
        canvas.draw()
        picture = Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3])
        palette = palette or _palette(picture)
        images.append(picture.quantize(palette=palette, dither=Image.Dither.NONE))
    images[0].save(path, save_all=True, append_images=images[1:], duration=1000 // rate, loop=0, optimize=False)


def _palette(picture: Image.Image) -> Image.Image:
    """The most frequent colours of a picture, each exact, none near another: so white paper stays white."""
    colours, counts = np.unique(np.asarray(picture).reshape(-1, 3), axis=0, return_counts=True)
    frequent = colours[np.argsort(-counts, kind="stable")]
    _, first = np.unique(frequent // _SHADES, axis=0, return_index=True)
    palette = Image.new("P", (1, 1))
    palette.putpalette(frequent[np.sort(first)][:_COLOURS].ravel().tolist())
    return palette


def _write_mp4(path: Path, target: Path, figure: Figure, frames: Iterable[object], rate: int) -> None:
    writer = FFMpegWriter(fps=rate, codec="h264", extra_args=["-pix_fmt", "yuv420p"])
    try:
        with writer.saving(figure, str(path), dpi=figure.dpi):
            for _ in frames:
                writer.grab_frame()
    except (subprocess.CalledProcessError, BrokenPipeError) as error:
        if isinstance(error.__context__, KeyboardInterrupt):  # Ctrl-C reaches ffmpeg too
            raise KeyboardInterrupt from None
        code = f" with exit code {error.returncode}" if isinstance(error, subprocess.CalledProcessError) else ""
        raise ValueError(f"{target}: ffmpeg failed{code}; repair it or choose {GIF}") from None
