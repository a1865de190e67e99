"""The papers' own experiments as a gate: run them side by side and collect their verdicts.

An experiment is imported by the process that runs it, and only then.
"""

from __future__ import annotations

import os
import signal
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import dataclass, replace
from importlib import import_module
from multiprocessing import get_context
from typing import Any

from ..files.names import no_such
from ..files.workers import no_ctrl_c_for_what_starts_here, workers_end_with_us
from ..pictures.figures import png
from ..reports.page import Section
from ..scoring.checks import Check, Suite
from .experiment import Experiment, Outcome, Progress

PAPERS: Mapping[str, str] = {
    "lee2012": "imufmu.papers.lee2012.experiment",
    "leechoi2018": "imufmu.papers.leechoi2018.experiment",
    "bennett2014": "imufmu.papers.bennett2014.experiment",
    "zihajehzadeh2014": "imufmu.papers.zihajehzadeh2014.experiment",
    "rizun2008": "imufmu.papers.rizun2008.experiment",
}

_BETWEEN_PROGRESS = 0.2  # s
_WHOLE = 1000  # steps of the progress of one paper

_shares: Any = None  # in a worker: the part done of every paper, shared with the parent process


@dataclass(frozen=True)
class Verdict:
    """What the experiments of one paper came to. outcome: None where they broke off; then error is the trace."""

    name: str
    title: str
    reference: str
    seconds: float
    outcome: Outcome | None
    error: str = ""

    @property
    def passed(self) -> bool:
        """False where nothing was checked, too."""
        return bool(self.checks) and not self.failed

    @property
    def checks(self) -> Sequence[Check]:
        return self.outcome.checks if self.outcome else ()

    @property
    def failed(self) -> Sequence[Check]:
        return [check for check in self.checks if not check.passed]

    @property
    def remarks(self) -> Sequence[str]:
        return self.outcome.remarks if self.outcome else ()

    def suite(self) -> Suite:
        """As every verdict is written."""
        return Suite(self.name, self.checks, self.seconds, self.remarks, self.error)


def validate(
    names: Sequence[str] = (),
    *,
    quick: bool = False,
    drawn: bool = False,
    papers: Mapping[str, str] = PAPERS,
    progress: Progress | None = None,
    finished: Callable[[Verdict], None] | None = None,
) -> list[Verdict]:
    """Run the experiments of some papers, or of all: one process per paper, at most one per core at a time.

    quick: fewer seeds. drawn: keep the figures, as PNG images, for a report. papers: modules with an EXPERIMENT, by
    name. finished: told of each paper as soon as it is done. Raises ValueError for an unknown paper. Experiments that
    break off give a verdict, not an exception.
    """
    for name in names:
        if name not in papers:
            raise ValueError(no_such("paper", name, papers))
    chosen = list(dict.fromkeys(names)) or list(papers)
    context = get_context("spawn")  # as on Windows and macOS; a fork could copy a lock that another thread holds
    shares = context.Array("d", len(chosen))
    pool = ProcessPoolExecutor(min(len(chosen), os.cpu_count() or 1), context, _prepare_worker, (shares,))
    with pool, workers_end_with_us():
        with no_ctrl_c_for_what_starts_here():
            runs = [pool.submit(_run, place, name, papers[name], quick, drawn) for place, name in enumerate(chosen)]
        pending = set(runs)
        while pending:
            done, pending = wait(pending, _BETWEEN_PROGRESS, FIRST_COMPLETED)
            if finished:
                for name, run in zip(chosen, runs, strict=True):
                    if run in done:
                        finished(_verdict(name, run))
            if progress:
                progress(round(_WHOLE * sum(shares[:])), _WHOLE * len(chosen))
        return [_verdict(name, run) for name, run in zip(chosen, runs, strict=True)]


def _verdict(name: str, run: Future[Verdict]) -> Verdict:
    """The result of a run; a process that died leaves none."""
    error = run.exception()
    return Verdict(name, name, "", 0.0, None, f"{type(error).__name__}: {error}") if error else run.result()


def _prepare_worker(shares: Any) -> None:
    global _shares
    _shares = shares
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def _run(place: int, name: str, module: str, quick: bool, drawn: bool) -> Verdict:
    """The experiments of one paper, in a worker."""

    def progress(done: int, total: int) -> None:
        _shares[place] = done / total

    title, reference, start = name, "", time.perf_counter()
    try:
        experiment: Experiment = import_module(module).EXPERIMENT
        title, reference = experiment.title, experiment.reference
        outcome = experiment.run(quick, progress)
        seconds = time.perf_counter() - start
        outcome = replace(outcome, sections=[_portable(section, drawn) for section in outcome.sections])
    except Exception:
        return Verdict(name, title, reference, time.perf_counter() - start, None, traceback.format_exc())
    progress(1, 1)
    return Verdict(name, title, reference, seconds, outcome)


def _portable(section: Section, drawn: bool) -> Section:
    """The section with its figure as an image: not every figure survives the way to another process."""
    figure = section.figure if drawn else None
    return replace(section, figure=figure if figure is None or isinstance(figure, bytes) else png(figure))
