"""Recordings of others: reading them, their units and their clocks."""
