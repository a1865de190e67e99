"""Names that a user gets wrong: what there is, and what may have been meant."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def no_such(what: str, name: str, known: Iterable[str], otherwise: str = "") -> str:
    """The message that nothing of this kind has this name, with all names there are and the one most like it.

    what: the kind, as "block". otherwise: what else could be given, as "or give an .fmu file".
    """
    there_is = ", ".join(known := list(known))
    close = get_close_matches(name, known, 1)
    parts = [f"no {what} is called {name!r}", f"there is {there_is}" + (f", {otherwise}" if otherwise else "")]
    return "; ".join([*parts, *(f"did you mean {match}?" for match in close)])
