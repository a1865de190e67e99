"""The native FMU of a block as a backend of the laws."""

from __future__ import annotations

from support.backend_python_fmu import PythonFmu


class NativeFmu(PythonFmu):
    """As ``PythonFmu``, with the FMU compiled from the block's generated C."""

    name = "native_fmu"
    kind = "native"
