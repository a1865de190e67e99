"""How the figures of an IMU's data sheet become parameters of a block, and what its start values stand for there."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from ..blocks.block import Block
from ..blocks.signals import Parameter
from .mathml import formula

G = 9.80665  # m/s2, the unit g of data sheets
DEG = math.pi / 180
PEAK = 0.617  # of a Gauss-Markov process: its Allan deviation over its standard deviation (IEEE Std 952)


@dataclass(frozen=True)
class Rule:
    """One figure N of a data sheet, for parameters of a unit whose description matches.

    scale: of N, from its unit to SI. formula: value from N, T the sample period, in the notation of mathml. variance:
    the parameter is a variance per sample, the figure a one-sided density.
    """

    unit: str
    described: str
    figure: str
    sheet_unit: str
    scale: float
    formula: str
    variance: bool = False

    def figure_of(self, value: float, period: float) -> float:
        """The figure that gives this value at this sample period (s)."""
        return (math.sqrt(2 * period * value) if self.variance else value) / self.scale


GYRO_NOISE = ("gyroscope noise density", "deg/s/√Hz", DEG)
ACCEL_NOISE = ("accelerometer noise density", "ug/√Hz", 1e-6 * G)
RULES = (
    Rule("rad2/s2", "Gyroscope variance per sample", *GYRO_NOISE, "(N pi / 180)^2 / (2 T)", variance=True),
    Rule("m2/s4", "Accelerometer variance per sample", *ACCEL_NOISE, "(9.80665e-6 N)^2 / (2 T)", variance=True),
    Rule("rad/s/sqrt(Hz)", "White (gyroscope )?noise|[Nn]oise density of the gyroscope", *GYRO_NOISE, "N pi / 180"),
    Rule("m/s2/sqrt(Hz)", "White noise|[Nn]oise density of the accelerometer", *ACCEL_NOISE, "9.80665e-6 N"),
    Rule("rad/s", "[Ff]ull scale|Largest reading", "gyroscope range", "deg/s", DEG, "N pi / 180"),
    Rule("m/s2", "[Ff]ull scale|Largest reading", "accelerometer range", "g", G, "9.80665 N"),
    Rule(
        "rad/s", "Constant bias|gyroscope bias at the start", "gyroscope zero-rate offset", "deg/s", DEG, "N pi / 180"
    ),
    Rule("m/s2", "Constant bias", "accelerometer zero-g offset", "mg", 1e-3 * G, "9.80665e-3 N"),
    Rule(
        "rad/s",
        "drifting bias",
        "gyroscope in-run bias stability",
        "deg/h",
        DEG / 3600 / PEAK,
        "N pi / (180 * 3600 * 0.617)",
    ),
    Rule("m/s2", "drifting bias", "accelerometer in-run bias stability", "ug", 1e-6 * G / PEAK, "9.80665e-6 N / 0.617"),
    Rule("1", "scale factor|scale and cross-axis errors", "scale factor tolerance, one sigma", "%", 0.01, "N / 100"),
)


def rule_for(parameter: Parameter) -> Rule | None:
    """The rule for a parameter, if data sheets print such a figure."""
    fits = (rule for rule in RULES if rule.unit == parameter.unit and re.search(rule.described, parameter.description))
    return next(fits, None)


def sheet_rows(block: Block) -> list[dict[str, str]]:
    """One row per parameter with a rule: name, figure, formula as MathML, the figure that the start stands for."""
    starts = {parameter.name: parameter.start_values()[0] for parameter in block.parameters}
    rows = []
    for parameter in block.parameters:
        rule = rule_for(parameter)
        if rule:
            value = rule.figure_of(starts[parameter.name], starts["sample_period"])
            rows.append(
                {
                    "name": parameter.name,
                    "figure": f"{rule.figure}, {rule.sheet_unit}",
                    "formula": formula(rule.formula, display=True),
                    "start": f"{value:.0f}" if value >= 1000 else f"{value:.3g}",
                }
            )
    return rows
