"""FMU of plumb, the error-state Kalman filter that takes velocity for noise."""

from imufmu.fmi.slave import BlockSlave


class Plumb(BlockSlave):
    where = "imufmu.estimators.plumb:BLOCK"
