"""The Kalman filter plumb, in parts: see README.md."""

from .filter import BLOCK

__all__ = ["BLOCK"]
