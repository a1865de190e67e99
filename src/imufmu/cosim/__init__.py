"""Co-simulation: a system description (SSP) in, results out."""

from ..archives import ArchiveError
from .description import DescriptionError
from .interface import WiringError
from .master import simulate
from .packing import pack
from .results import Result, read_hdf5
from .slave import SimulationError
from .system import System, locate

__all__ = [
    "ArchiveError",
    "DescriptionError",
    "Result",
    "SimulationError",
    "System",
    "WiringError",
    "locate",
    "pack",
    "read_hdf5",
    "simulate",
]
