"""A car: body, tyres, road, driver, outline."""

from .plant import BLOCK

__all__ = ["BLOCK"]
