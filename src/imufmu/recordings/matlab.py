"""Read numeric matrices from MATLAB files of version 5 to 7 [1], damaged ones without harm.

SciPy reads more, but its reader trusts the type codes in the file: one wrong byte ends the Python process.

[1] MathWorks, MAT-File Format, chapter "Level 5 MAT-Files"
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np

_HEADER_SIZE = 128
_MATRIX, _COMPRESSED = 14, 15  # kinds of element
_NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_NUMERIC_CLASSES = range(6, 16)  # of a matrix: double, single, and the integers
_COMPLEX = 0x800
_LARGEST = 2**30  # bytes of one variable after decompression: days of samples, and less than a machine's memory


class MatlabError(ValueError):
    """Not a MATLAB file that can be read; the message says why."""


def read_matlab(path: Path) -> dict[str, np.ndarray | None]:
    """Variables by name: real numeric matrices as float64 arrays, None for every other kind.

    Raises MatlabError, and OSError if there is no such file.
    """
    data = path.read_bytes()
    order = {b"\x00\x01IM": "<", b"\x01\x00MI": ">"}.get(data[124:_HEADER_SIZE])
    if order is None:
        raise MatlabError("not a MATLAB file of version 5 to 7; in MATLAB, save with the option -v7")
    variables = {}
    for kind, content in _elements(data[_HEADER_SIZE:], order):
        if kind == _COMPRESSED:
            kind, content = next(_elements(_inflated(content), order), (0, b""))
        if kind != _MATRIX:
            raise MatlabError(f"damaged: data of kind {kind} in place of a variable")
        if content:
            name, value = _matrix(content, order)
            variables[name] = value
    return variables


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Kind and content of one element after the other. order: byte order, < or >."""
    at = 0
    while at < len(data):
        if len(data) < at + 8:
            raise MatlabError("damaged: an element is cut short")
        kind, size = struct.unpack_from(f"{order}II", data, at)
        start, padding = at + 8, -size % 8 if kind != _COMPRESSED else 0
        if kind >> 16:  # up to four bytes, stored within the tag
            kind, size, start = kind & 0xFFFF, kind >> 16, at + 4
            padding = 4 - size
        if len(data) < start + size or padding < 0:
            raise MatlabError("damaged: an element is cut short")
        yield kind, data[start : start + size]
        at = start + size + padding


def _inflated(content: bytes) -> bytes:
    inflater = zlib.decompressobj()
    try:
        inflated = inflater.decompress(content, _LARGEST)
    except zlib.error:
        raise MatlabError("damaged: a compressed variable does not unpack") from None
    if not inflater.eof:
        raise MatlabError(f"damaged: a compressed variable is cut short or larger than {_LARGEST} bytes")
    return inflated


def _matrix(content: bytes, order: str) -> tuple[str, np.ndarray | None]:
    """Name and value of a variable."""
    parts = list(islice(_elements(content, order), 4))  # flags, dimensions, name, values
    if len(parts) < 3 or len(parts[0][1]) < 8:
        raise MatlabError("damaged: a variable without description")
    (flags,) = struct.unpack_from(f"{order}I", parts[0][1])
    name = parts[2][1].decode("ascii", errors="replace")
    if flags & 0xFF not in _NUMERIC_CLASSES or flags & _COMPLEX:
        return name, None
    shape = struct.unpack(f"{order}{len(parts[1][1]) // 4}i", parts[1][1][: len(parts[1][1]) // 4 * 4])
    kind, values = parts[3] if len(parts) == 4 else (9, b"")
    number = np.dtype(order + _NUMBERS.get(kind, "V1"))
    if number.kind == "V" or min(shape, default=-1) < 0 or math.prod(shape) * number.itemsize != len(values):
        raise MatlabError(f"damaged: {name!r} has {len(values)} bytes of kind {kind} for a matrix of shape {shape}")
    return name, np.frombuffer(values, number).astype(float).reshape(shape, order="F")
