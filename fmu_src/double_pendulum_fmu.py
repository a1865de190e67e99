"""FMU of the planar pendulum with two links."""

from imufmu.fmi.slave import BlockSlave
from imufmu.plants import pendulum


class DoublePendulum(BlockSlave):
    block = pendulum.DOUBLE_PENDULUM
