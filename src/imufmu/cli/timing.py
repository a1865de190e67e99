"""What the recordings of a folder tell about the timing of their device, as ``imufmu inspect FOLDER`` prints it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .console import notes, out, print_table, progress_bar


def tell_timing(folder: Path) -> None:
    """Print the table and the verdict."""
    result = _found(folder)
    notes(result.notes)
    if result.timings:
        n = len(result.recordings)
        out.print(f"Timing of the gyroscope, by {n} recording{'s' * (n > 1)} of one device")
        print_table(result.table)
    out.print(result.verdict, markup=False)


def timing_facts(folder: Path) -> dict[str, Any]:
    """The same for programs."""
    result = _found(folder)
    timings = [vars(timing) for timing in result.timings]
    return {"gyro_index": result.gyro_index, "verdict": result.verdict, "timings": timings, "notes": [*result.notes]}


def _found(folder: Path) -> Any:
    from ..benchmarks.timing import device_timing
    from ..recordings.reading import recordings_in

    with progress_bar(f"timing of {folder}") as progress:
        return device_timing(recordings_in(folder), progress)
