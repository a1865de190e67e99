"""Try an FMU: instantiate, initialise, take one step, free. Run in a process of its own, because an FMU may crash it.

That process runs this file as a script, so that it has no imufmu in memory that an FMU would have to share.
"""

from __future__ import annotations

import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import fmpy

_SECONDS = 60.0
HUNG = f"it did not finish one step within {_SECONDS:g} s"
_STEPPED = "imufmu: step taken"  # the process prints it; what follows is the end of the FMU


@dataclass(frozen=True)
class Trial:
    """How it ended: ``fault`` is empty after a good step; ``said`` is what the FMU or FMPy printed.

    closing: what went wrong after a good step, when the FMU was closed; empty if nothing did.
    """

    fault: str
    said: str
    closing: str = ""


def try_step(fmu: Path) -> Trial:
    """One step of the FMU in a process of its own, at most a minute long."""
    command = [sys.executable, "-P", __file__, str(fmu)]  # -P: no import from this file's folder
    try:
        done = subprocess.run(command, capture_output=True, text=True, errors="replace", timeout=_SECONDS)
    except subprocess.TimeoutExpired:
        return Trial(HUNG, "")
    printed = (done.stdout + done.stderr).splitlines()
    said = "\n".join(line for line in printed if line.strip() and line != _STEPPED)
    if done.returncode < 0:
        crash = f"it crashed its process ({signal.Signals(-done.returncode).name})"
        return Trial("", said, crash) if _STEPPED in printed else Trial(crash, said)
    if done.returncode:
        lines = said.splitlines() or [f"it ended its process with exit code {done.returncode}"]
        return Trial(lines[-1], "\n".join(lines[:-1]))
    if _STEPPED not in printed:  # an FMU that calls exit(0) takes no step
        return Trial("it ended its process before the step was done", said)
    return Trial("", said)


def main() -> None:
    """Take the step; a fault is the last line printed and exit code 1."""
    path = sys.argv[1]
    experiment = fmpy.read_model_description(path, validate=False).defaultExperiment
    start = float(experiment.startTime or 0.0) if experiment else 0.0
    step = float(experiment.stepSize or 0.0) if experiment else 0.0
    step = step if step > 0 else 0.01

    def stepped(time: float, _recorder: object) -> bool:
        if time > start:
            print(f"\n{_STEPPED}", flush=True)  # on a line of its own, whatever the FMU printed before
        return True

    try:
        fmpy.simulate_fmu(
            path,
            validate=False,
            start_time=start,
            stop_time=start + step,
            output_interval=step,
            step_finished=stepped,
        )
    except Exception as error:  # whatever FMPy or the FMU raises is the finding
        print(f"{type(error).__name__}: {error}")
        sys.exit(1)


if __name__ == "__main__":
    main()
