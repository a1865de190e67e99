"""Draw architecture.svg: the rooms of src/imufmu, and the way of one accelerometer sample from a plant to a verdict.

python docs/architecture.py
"""

from pathlib import Path

# From top to bottom; each imports only from rooms below it.
ROOMS = (
    ("cli", "the verbs of the command line"),
    ("gate", "limits that must hold, over seeds"),
    ("benchmarks", "filters side by side, cost of a sample"),
    ("papers", "the papers' experiments and verdicts"),
    ("reports", "tables and pages for people"),
    ("pictures", "figures, movies, horizons"),
    ("scoring", "errors of an estimate against the truth"),
    ("cosim", "system description in, results out"),
    ("fmi", "a block becomes an FMU; doctor"),
    ("compiled", "a block becomes C and runs as C"),
    ("registry", "the list of blocks"),
    ("estimators, sensors, plants", "one block, one file"),
    ("recordings", "logs of others, clocks, units"),
    ("blocks", "what a block is, and how it runs"),
    ("files", "archives, tables, whole or not at all"),
)

# The way of a sample: the room, what is passed on, what happens.
WAY = (
    ("plants", "specific_force", "the truth at t_k: R_SN (a_N + g e_z), in the sensor's frame"),
    ("fmi", "plant.fmu", "fmi2GetReal: three Reals of the plant's FMU"),
    ("cosim", "connection", "along the flow of signals, within the tick: no delay"),
    ("sensors", "accel", "axes, scale, bias, drift, noise, range, resolution"),
    ("cosim", "connection", "set as input of time t_k, then fmi2DoStep(t_k, h)"),
    ("estimators", "vertical", "predict by the gyroscope, correct by the accelerometer"),
    ("cosim", "Result", "the row of t_k holds truth, reading and estimate"),
    ("scoring", "tilt_rmse_deg", "angle to the plant's vertical, at equal sample_time"),
    ("gate", "verdict", "value against limit: exit code, page, JUnit"),
)

WIDTH, ROW, TOP, GAP = 1000, 40, 74, 8
LEFT, LEFT_WIDTH = 20, 400
RIGHT, RIGHT_WIDTH = 470, 510

STYLE = """
  .ground { fill: #ffffff }
  text { font: 14px system-ui, sans-serif; fill: #26323f }
  .head { font-weight: 600; font-size: 17px }
  .name { font: 600 14px ui-monospace, monospace }
  .small { font-size: 13px; fill: #51606e }
  .room { fill: #eef3f8; stroke: #9fb4c7 }
  .step { fill: #fdf6e6; stroke: #d6b972 }
  .arrow { stroke: #b8862b; stroke-width: 2; fill: none }
  .tip { fill: #b8862b }
  @media (prefers-color-scheme: dark) {
    .ground { fill: #0d1117 }
    text { fill: #dbe4ec } .small { fill: #a4b2bf }
    .room { fill: #1d2935; stroke: #47617a } .step { fill: #2c2719; stroke: #7d6a35 }
    .arrow { stroke: #d6a84a } .tip { fill: #d6a84a }
  }
"""


def text(x: float, y: float, kind: str, words: str) -> str:
    return f'<text x="{x}" y="{y}" class="{kind}">{words}</text>'


def box(x: float, y: float, width: float, kind: str) -> str:
    return f'<rect x="{x}" y="{y}" width="{width}" height="{ROW}" rx="5" class="{kind}"/>'


def rooms() -> list[str]:
    parts = [
        text(LEFT, TOP - 38, "head", "The rooms"),
        text(LEFT, TOP - 16, "small", "each imports from rooms below it"),
    ]
    for i, (name, words) in enumerate(ROOMS):
        y = TOP + i * (ROW + GAP)
        beside = LEFT + (260 if "," in name else 120)
        parts += [
            box(LEFT, y, LEFT_WIDTH, "room"),
            text(LEFT + 12, y + 25, "name", name),
            text(beside, y + 25, "small", words),
        ]
    return parts


def way() -> list[str]:
    pitch = (len(ROOMS) * (ROW + GAP) - GAP - ROW) / (len(WAY) - 1)
    parts = [
        text(RIGHT, TOP - 38, "head", "One accelerometer sample"),
        text(RIGHT, TOP - 16, "small", "from a plant to a verdict, through the FMUs of a system"),
    ]
    for i, (room, name, words) in enumerate(WAY):
        y, middle = TOP + i * pitch, RIGHT + 60
        parts += [box(RIGHT, y, RIGHT_WIDTH, "step"), text(RIGHT + 12, y + 17, "name", name)]
        parts += [text(RIGHT + 12, y + 34, "small", words)]
        parts += [f'<text x="{RIGHT + RIGHT_WIDTH - 12}" y="{y + 17}" class="small" text-anchor="end">{room}</text>']
        if i:
            parts += [f'<path class="arrow" d="M{middle} {y - pitch + ROW} V{y - 6}"/>']
            parts += [f'<path class="tip" d="M{middle - 5} {y - 8} h10 l-5 8 z"/>']
    return parts


def drawing() -> str:
    height = TOP + len(ROOMS) * (ROW + GAP) + 12
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" width="{WIDTH}" height="{height}">'
    ground = f'<rect width="{WIDTH}" height="{height}" class="ground"/>'
    return "\n".join([head, f"<style>{STYLE}</style>", ground, *rooms(), *way(), "</svg>", ""])


if __name__ == "__main__":
    Path(__file__).with_suffix(".svg").write_text(drawing(), encoding="utf-8")
