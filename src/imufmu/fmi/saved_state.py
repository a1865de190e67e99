"""The state of a Python FMU as bytes: what it was saved by, a hash, and JSON, in which numbers keep every bit."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from .runtime import IN_MEMORY

_DIGITS = 64  # of each of the two hashes in front


class DamagedState(ValueError):
    """Bytes that are no state of this build, or not any more."""

    def __init__(self) -> None:
        super().__init__("the serialised state was changed, or is that of another FMU or another build")


def to_bytes(state: Any) -> bytes:
    """The state, with the means to see that it is unchanged."""
    content = json.dumps(state).encode()
    return IN_MEMORY.encode() + hashlib.sha256(content).hexdigest().encode() + content


def from_bytes(saved: bytes) -> Any:
    """The state that these bytes hold. Raises DamagedState."""
    build, digest, content = saved[:_DIGITS], saved[_DIGITS : 2 * _DIGITS], saved[2 * _DIGITS :]
    if build != IN_MEMORY.encode() or digest != hashlib.sha256(content).hexdigest().encode():
        raise DamagedState
    return json.loads(content)
