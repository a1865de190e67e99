"""How often a limit must hold over many runs, and when no further run can change the verdict."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.stats import beta


def surely_at_least(passed: int, runs: int, confidence: float) -> float:
    """The part of all runs that holds at least, with this confidence, where ``passed`` of ``runs`` did.

    Lower limit, one-sided [1].

    [1] Clopper, Pearson, The use of confidence or fiducial limits illustrated in the case of the binomial, Biometrika
        26(4), 1934, doi:10.1093/biomet/26.4.404
    """
    return float(beta.ppf(1 - confidence, passed, runs - passed + 1)) if passed else 0.0


@dataclass(frozen=True)
class Demand:
    """part: of the runs, that must hold. confidence: None to count the runs that there are. runs: planned."""

    part: float
    confidence: float | None
    runs: int

    def share(self, passed: int) -> float:
        """What is compared with ``part`` after all runs of which ``passed`` hold."""
        if self.confidence is None:
            return passed / self.runs
        return surely_at_least(passed, self.runs, self.confidence)

    def met(self, passed: int) -> bool:
        """After all runs."""
        return self.share(passed) >= self.part - 1e-12  # 950 of 1000 are 95 %

    @property
    def possible(self) -> bool:
        """Whether so many runs can show it at all."""
        return self.met(self.runs)

    def decided(self, passed: int, failed: int) -> bool | None:
        """The verdict after some of the runs, None while the others can change it."""
        if self.met(passed):
            return True
        return None if self.met(self.runs - failed) else False
