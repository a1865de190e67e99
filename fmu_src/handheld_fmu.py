"""FMU of the rigid body in a random hand."""

from imufmu.fmi.slave import BlockSlave


class Handheld(BlockSlave):
    where = "imufmu.plants.handheld:BLOCK"
