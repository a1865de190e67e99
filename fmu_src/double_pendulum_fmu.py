"""FMU of the planar pendulum with two links."""

from imufmu.fmi.slave import BlockSlave


class DoublePendulum(BlockSlave):
    where = "imufmu.plants.pendulum:DOUBLE_PENDULUM"
