"""Fixtures of every test."""

from __future__ import annotations

import numpy as np
import pytest


@pytest.fixture
def rng() -> np.random.Generator:
    """Random numbers, the same in every run and whatever other tests ran before."""
    return np.random.default_rng(2012)
