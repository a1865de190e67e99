"""Filters side by side on recordings, and what a sample of each costs."""
