"""The explicit list of blocks. Common tests, builds and the command line walk it."""

from __future__ import annotations

from .blocks.block import Block
from .estimators import bennett2014, lee2012, leechoi2018, plumb, rizun2008, zihajehzadeh2014
from .plants import handheld, human, pendulum, vehicle
from .sensors import imu

ESTIMATORS: tuple[Block, ...] = (
    lee2012.BLOCK,
    leechoi2018.BLOCK,
    rizun2008.BLOCK,
    zihajehzadeh2014.BLOCK,
    bennett2014.BLOCK,
    plumb.BLOCK,
)
# They tell the attitude of a while ago, and of which instant.
DELAYED: tuple[Block, ...] = (plumb.LAGGED,)
PLANTS: tuple[Block, ...] = (
    pendulum.PENDULUM,
    pendulum.DOUBLE_PENDULUM,
    handheld.BLOCK,
    human.BLOCK,
    vehicle.BLOCK,
)
SENSORS: tuple[Block, ...] = (imu.BLOCK,)

BLOCKS: dict[str, Block] = {block.name: block for block in (*ESTIMATORS, *DELAYED, *PLANTS, *SENSORS)}
