"""FMU of the planar pendulum with one link."""

from imufmu.fmi.slave import BlockSlave
from imufmu.plants import pendulum


class Pendulum(BlockSlave):
    block = pendulum.PENDULUM
