"""Tables of numbers as HDF5 files: datasets in groups, each with its unit."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np

from .atomic import atomic_write


@dataclass(frozen=True)
class Dataset:
    """Numbers at a place in the file: names of its groups, then its own. unit: None where it is not known.

    first_index: of its elements, where these have names.
    """

    place: Sequence[str]
    values: np.ndarray
    unit: str | None
    first_index: int = 1


def write_hdf5(path: str | os.PathLike[str], attributes: Mapping[str, Any], datasets: Iterable[Dataset]) -> list[str]:
    """Write datasets in their order, whole or not at all, and give back a note on each whose name HDF5 cannot hold.

    Such a name is changed as in an address of the web, and the attribute ``name`` of the dataset holds it as it was.
    Raises WriteError if the file cannot be written.
    """
    notes = []
    with atomic_write(path) as temporary, _Disk(temporary) as disk, h5py.File(disk, "w", track_order=True) as file:
        file.attrs.update(attributes)
        for dataset in datasets:
            links = [_link(name, i < len(dataset.place) - 1) for i, name in enumerate(dataset.place)]
            written = file.create_dataset("/".join(links), data=dataset.values, track_order=True)
            if dataset.unit is not None:
                written.attrs["unit"] = dataset.unit
            if dataset.first_index != 1:
                written.attrs["first_index"] = dataset.first_index
            if links != list(dataset.place):
                written.attrs["name"] = ".".join(dataset.place)
                notes.append(f"{'.'.join(dataset.place)} is {'/'.join(links)} in {path}, as HDF5 has no such names")
    return notes


def _link(name: str, is_group: bool) -> str:
    """A name that HDF5 can hold. A group is never called time, as the dataset ``/time`` is beside it."""
    for character in "%/":
        name = name.replace(character, f"%{ord(character):02X}")
    if name == "." or (is_group and name == "time"):
        return f"%{ord(name[0]):02X}{name[1:]}"
    return name or "%"


class _Disk:
    """A file that takes whatever HDF5 writes, and tells only at the end that the disk was full.

    The library answers an error from a file with more of them while it closes its objects, and at times with a crash.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open("r+b", buffering=0)
        self._fault: OSError | None = None

    def __enter__(self) -> _Disk:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._file.close()
        if self._fault:
            raise self._fault

    def write(self, data: Any) -> int:
        rest = memoryview(data)
        try:
            while rest and not self._fault:
                rest = rest[self._file.write(rest) :]
        except OSError as error:
            self._fault = error
        return len(data)

    def truncate(self, size: int) -> int:
        try:
            return self._file.truncate(size)
        except OSError as error:
            self._fault = self._fault or error
            return size

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        return self._file.tell()

    def read(self, size: int = -1) -> bytes:
        return self._file.read(size)

    def readinto(self, buffer: Any) -> int:
        return self._file.readinto(buffer)

    def flush(self) -> None:
        """Nothing is held back."""
