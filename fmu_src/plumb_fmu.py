"""FMU of plumb, the error-state Kalman filter that takes velocity for noise."""

from imufmu.estimators import plumb
from imufmu.fmi.slave import BlockSlave


class Plumb(BlockSlave):
    block = plumb.BLOCK
