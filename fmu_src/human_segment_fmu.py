"""FMU of a sensor on a segment of a moving person."""

from imufmu.fmi.slave import BlockSlave
from imufmu.plants import human_segment


class HumanSegment(BlockSlave):
    block = human_segment.BLOCK
