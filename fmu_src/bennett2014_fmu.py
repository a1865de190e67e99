"""FMU of the Kalman filter for two links of Bennett, Jafari and Gans (2014)."""

from imufmu.fmi.slave import BlockSlave


class Bennett2014(BlockSlave):
    where = "imufmu.estimators.bennett2014:BLOCK"
