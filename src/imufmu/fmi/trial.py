"""Try an FMU: instantiate, initialise, take one step, free. Run in a process of its own, because an FMU may crash it.

That process runs this file as a script, so that it has no imufmu in memory that an FMU would have to share.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import fmpy

SECONDS = 60.0

_STEPPED, _DONE = b"stepped\n", b"done\n"  # what the process answers, before which may be a fault


@dataclass(frozen=True)
class Trial:
    """How it ended: ``fault`` is empty after a good step; ``said`` is the end of what the FMU or FMPy printed.

    closing: what went wrong after a good step, when the FMU was closed; empty if nothing did. hung: it took too long.
    """

    fault: str
    said: str
    closing: str = ""
    hung: bool = False


def try_step(fmu: Path, seconds: float = SECONDS) -> Trial:
    """One step of the FMU in a process of its own, at most so long. Raises ScratchError."""
    # Here, because the script that this file also is has no package around it.
    from ..files.scratch import scratch_folder
    from .child import Child

    with scratch_folder("trial") as folder:
        child = Child(["-u", "-P", __file__, str(fmu.resolve())], folder)  # -P: no import from this file's folder
        try:
            answer = _answer(child, seconds)
            fate = "" if answer is None else child.fate()
        finally:
            child.kill()
    said = child.last_lines
    if answer is None:
        return Trial(f"it did not finish one step within {seconds:g} s", said, hung=True)
    before, stepped, after = answer.partition(_STEPPED)
    if answer.endswith(_DONE):
        fault = (after or before).removesuffix(_DONE).decode(errors="replace").strip()
        return Trial(fault, said, f"it {fate}" if "crashed" in fate else "")
    if stepped and not after:
        return Trial("", said, f"it {fate}")
    return Trial("it ended its process before the step was done" if fate.endswith(" 0") else f"it {fate}", said)


def _answer(child: Any, seconds: float) -> bytes | None:
    """Everything that the process answers; None if that takes longer."""
    answer, end = b"", time.monotonic() + seconds
    while not answer.endswith(_DONE):
        if not child.wait(max(0.0, end - time.monotonic())):
            return None
        chunk = os.read(child.answers, 4096)
        if not chunk:
            break
        answer += chunk
    return answer


def main() -> None:
    """Take the step and answer; what is printed goes where errors go."""
    answers = os.dup(1)
    os.dup2(2, 1)
    path = sys.argv[1]
    try:
        _take_step(path, answers)
    except Exception as error:  # whatever FMPy or the FMU raises is the finding
        os.write(answers, f"{type(error).__name__}: {error}\n".encode(errors="replace"))
    os.write(answers, _DONE)


def _take_step(path: str, answers: int) -> None:
    experiment = fmpy.read_model_description(path, validate=False).defaultExperiment
    start = float(experiment.startTime or 0.0) if experiment else 0.0
    step = float(experiment.stepSize or 0.0) if experiment else 0.0
    step = step if step > 0 else 0.01

    def stepped(time: float, _recorder: object) -> bool:
        if time > start:
            os.write(answers, _STEPPED)
        return True

    fmpy.simulate_fmu(
        path,
        validate=False,
        start_time=start,
        stop_time=start + step,
        output_interval=step,
        step_finished=stepped,
    )


if __name__ == "__main__":
    main()
