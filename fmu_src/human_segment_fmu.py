"""FMU of a sensor on a segment of a moving person."""

from imufmu.fmi.slave import BlockSlave


class HumanSegment(BlockSlave):
    where = "imufmu.plants.human:BLOCK"
