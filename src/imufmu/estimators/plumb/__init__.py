"""The Kalman filter plumb, in parts: see README.md."""

from .filter import BLOCK
from .lag_block import BLOCK as LAGGED

__all__ = ["BLOCK", "LAGGED"]
