"""Limits that a system or a recording must hold, and the verdict."""
