"""FMU of the planar pendulum with one link."""

from imufmu.fmi.slave import BlockSlave


class Pendulum(BlockSlave):
    where = "imufmu.plants.pendulum:PENDULUM"
