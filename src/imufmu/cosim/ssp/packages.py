"""Archives of SSP, unpacked for as long as a system lives."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from ...files.archives import ArchiveError, unpack
from ...files.scratch import new_scratch

STRUCTURE = "SystemStructure.ssd"  # the description inside an .ssp


class Packages:
    """Folders of unpacked archives, each archive unpacked once."""

    def __init__(self) -> None:
        self._folders: dict[Path, tuple[Path, Callable[[], None]]] = {}

    def structure(self, path: Path, name: str = "") -> tuple[Path, Path]:
        """Description in an archive, by its name where it is not the usual one, and the folder that is the archive's.

        Raises ArchiveError.
        """
        if path not in self._folders:
            self._folders[path] = new_scratch("ssp")
            unpack(path, self._folders[path][0])
        folder = self._folders[path][0]
        found = (folder / (name or STRUCTURE)).resolve()
        if not (found.is_relative_to(folder) and found.is_file()):
            told = f"{path}: {name or STRUCTURE} is missing"
            raise ArchiveError(told if name else f"{told}: this is no SSP")
        return found, folder

    def shown(self, text: str) -> str:
        """A user knows the archives, not the folders that they were unpacked to."""
        for path, (folder, _) in self._folders.items():
            text = text.replace(f"{folder}{os.sep}", f"{path}: ")
        return text

    def delete(self) -> None:
        """Delete all folders."""
        for _, delete in self._folders.values():
            delete()
