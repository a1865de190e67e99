"""Draw models/human_segment/human_segment.png: python models/human_segment/figure.py"""

from __future__ import annotations

from pathlib import Path

import matplotlib
import numpy as np

from imufmu.blocks.running import simulate
from imufmu.blocks.vocabulary import GRAVITY
from imufmu.plants.human.plant import BLOCK, SEGMENTS

matplotlib.use("Agg")
from matplotlib import pyplot as plt

# Name, parameters, times of the figures (s), distance between them where the person stays (m).
CASES = (
    ("walking, thigh", {"activity": 0, "segment": 1, "impact_acceleration": 25}, np.arange(5.0, 6.35, 0.15), 0.35),
    (
        "running, foot",
        {"activity": 1, "segment": 3, "speed": 3.3, "cadence": 168, "impact_acceleration": 80},
        np.arange(5.0, 5.8, 0.08),
        0.25,
    ),
    ("jump, pelvis", {"activity": 2, "segment": 0}, np.arange(1.0, 2.95, 0.15), 0.55),
    ("rollerblading, trunk", {"activity": 3, "segment": 4, "speed": 5}, np.arange(6.0, 8.5, 0.3), 0.0),
    ("sit-to-stand, trunk", {"activity": 4, "segment": 4}, np.arange(1.0, 3.05, 0.25), 0.7),
)
STEP = 0.002  # s


def main() -> None:
    figure, axes = plt.subplots(len(CASES), 2, figsize=(13, 13), width_ratios=(3, 2), layout="constrained")
    for (name, parameters, times, apart), (body, reading) in zip(CASES, axes, strict=True):
        run = simulate(BLOCK, times[-1] + 0.5, STEP, parameters={"max_step": 1.0} | parameters)
        rows = np.round(times / STEP).astype(int)
        for number, row in enumerate(rows):
            points = run["skeleton"][row] - (run["skeleton"][rows[0], 1, 0], 0, 0)
            # A skater is seen from the front: the sway is what there is to see.
            across = number * 0.9 - points[:, 1] if "roller" in name else points[:, 0] + number * apart
            body.plot(across, points[:, 2], color=plt.cm.viridis(0.9 * number / len(rows)), lw=1.2)
        body.axhline(0, color="0.6", lw=0.8)
        body.set(aspect="equal", title=f"{name}, every {times[1] - times[0]:.2g} s", ylabel="up (m)")
        shown = (run.time >= times[0]) & (run.time <= times[-1])
        reading.plot(run.time[shown], run["specific_force"][shown] / GRAVITY, lw=1.0)
        reading.set(title=f"specific force on the {SEGMENTS[parameters['segment']]}", ylabel="in g")
        reading.legend(("x", "y", "z"), loc="upper right", fontsize=8)
    axes[-1, 0].set_xlabel("along the way, postures set apart (m)")
    axes[-1, 1].set_xlabel("time (s)")
    figure.savefig(Path(__file__).with_name("human_segment.png"), dpi=80)


if __name__ == "__main__":
    main()
