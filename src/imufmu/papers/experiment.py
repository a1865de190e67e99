"""What an experiment of a paper is: a function that runs it, and the tables, figures and checks it comes back with."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from ..reports.page import Section
from ..scoring.checks import Check

Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Outcome:
    """What came out: sections of the report (tables beside the paper's values, figures), checks, and remarks in words.

    remarks: conclusions of the paper that do not reproduce, and why, one sentence each.
    """

    sections: Sequence[Section]
    checks: Sequence[Check]
    remarks: Sequence[str] = field(default=())

    @property
    def passed(self) -> bool:
        return all(check.passed for check in self.checks)


@dataclass(frozen=True)
class Experiment:
    """The experiments of one paper.

    run(quick, progress): quick takes fewer seeds; progress(done, total) is called now and then.
    """

    name: str
    title: str
    reference: str
    run: Callable[[bool, Progress], Outcome]
