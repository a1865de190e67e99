"""The explicit list of blocks. Common tests, builds and the command line walk it."""

from __future__ import annotations

from .block import Block
from .estimators import lee2012
from .plants import pendulum
from .sensors import imu

ESTIMATORS: tuple[Block, ...] = (lee2012.BLOCK,)
PLANTS: tuple[Block, ...] = (pendulum.PENDULUM, pendulum.DOUBLE_PENDULUM)
SENSORS: tuple[Block, ...] = (imu.BLOCK,)

BLOCKS: dict[str, Block] = {block.name: block for block in (*ESTIMATORS, *PLANTS, *SENSORS)}
