"""IMU attitude estimators as drop-in FMUs, with the plants, IMU models and validation runs to trust them.

What a user imports is listed here, and every block by its name (``imufmu.lee2012``, ``imufmu.imu``, ...). A name brings
its module when it is first asked for: ``import imufmu`` loads nothing else.
"""

from __future__ import annotations

import importlib
from typing import Any

__version__ = "0.1.0"

# Name, module, and its name there where that differs.
_FACE: dict[str, tuple[str, str]] = {
    name: (module, own or name)
    for module, names in {
        "blocks.running": {"Stream": "", "Trajectory": ""},
        "compiled.offline": {"run_offline": ""},
        "compiled.running": {"run": "", "run_plant": "simulate"},
        "benchmarks.recordings": {"benchmark": ""},
        "benchmarks.timing": {"device_timing": ""},
        "compiled.compilers": {"BuildError": ""},
        "cosim.description": {"DescriptionError": ""},
        "cosim.interface": {"WiringError": ""},
        "cosim.master": {"simulate": ""},
        "cosim.packing": {"pack": ""},
        "cosim.replay": {"Replay": "", "estimator_fmu": "", "replay": ""},
        "cosim.results": {"Result": "", "read_hdf5": ""},
        "cosim.errors": {"SimulationError": ""},
        "cosim.system": {"System": "", "locate": ""},
        "files.archives": {"ArchiveError": ""},
        "fmi.build": {"build_fmu": ""},
        "fmi.doctor": {"examine": ""},
        "fmi.native": {"build_native": ""},
        "pictures.bodies": {"body_of": "", "recorded": ""},
        "pictures.figures": {"save_figure": "save"},
        "pictures.motion_figures": {"stick_figure": ""},
        "papers.validate": {"validate": ""},
        "recordings.inspection": {"inspect_recording": "inspect"},
        "recordings.reading": {"Recording": "", "RecordingError": "", "read_recording": "read"},
        "registry": {"BLOCKS": "", "DELAYED": "", "ESTIMATORS": "", "PLANTS": "", "SENSORS": ""},
        "scoring.metrics": {"errors": ""},
        "scoring.prediction": {"predict": ""},
        "scoring.systems": {"Comparison": "", "comparisons": ""},
    }.items()
    for name, own in names.items()
}
_BLOCKS = (
    "bennett2014",
    "double_pendulum",
    "handheld",
    "human_segment",
    "imu",
    "lee2012",
    "leechoi2018",
    "pendulum",
    "plumb",
    "plumb_lag",
    "rizun2008",
    "vehicle",
    "zihajehzadeh2014",
)

__all__ = sorted([*_FACE, *_BLOCKS])


def __getattr__(name: str) -> Any:
    if name in _FACE:
        module, own = _FACE[name]
        value = getattr(importlib.import_module(f"{__name__}.{module}"), own)
    elif name in _BLOCKS:
        value = importlib.import_module(f"{__name__}.registry").BLOCKS[name]
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *__all__])
