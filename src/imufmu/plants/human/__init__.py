"""A sensor on a moving person: body, gait, activities."""

from .plant import BLOCK

__all__ = ["BLOCK"]
