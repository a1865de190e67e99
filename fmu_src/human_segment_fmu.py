"""FMU of a sensor on a segment of a moving person."""

from imufmu.fmi.slave import BlockSlave
from imufmu.plants import human


class HumanSegment(BlockSlave):
    block = human.BLOCK
