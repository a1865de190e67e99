"""FMU of the gravity and acceleration Kalman filter of Lee and Choi (2018)."""

from imufmu.estimators import leechoi2018
from imufmu.fmi.slave import BlockSlave


class LeeChoi2018(BlockSlave):
    block = leechoi2018.BLOCK
