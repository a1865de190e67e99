"""The explicit list of blocks. Common tests, builds and the command line walk it."""

from __future__ import annotations

from .block import Block
from .estimators import lee2012

ESTIMATORS: tuple[Block, ...] = (lee2012.BLOCK,)
PLANTS: tuple[Block, ...] = ()
SENSORS: tuple[Block, ...] = ()

BLOCKS: dict[str, Block] = {block.name: block for block in (*ESTIMATORS, *PLANTS, *SENSORS)}
