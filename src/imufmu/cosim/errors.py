"""What can go wrong in a run; in a module of its own that loads nothing."""


class SimulationError(RuntimeError):
    """A run cannot go on; the message names component, call, time and what the FMU said."""
