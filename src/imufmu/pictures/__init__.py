"""Figures, bodies, horizons and movies."""
