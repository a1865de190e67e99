"""FMU of the rigid body in a random hand."""

from imufmu.fmi.slave import BlockSlave
from imufmu.plants import handheld


class Handheld(BlockSlave):
    block = handheld.BLOCK
