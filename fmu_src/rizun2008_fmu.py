"""FMU of the optimal Wiener filter of Rizun (2008)."""

from imufmu.fmi.slave import BlockSlave


class Rizun2008(BlockSlave):
    where = "imufmu.estimators.rizun2008:BLOCK"
