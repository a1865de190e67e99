"""FMU of the gravity and acceleration Kalman filter of Lee and Choi (2018)."""

from imufmu.fmi.slave import BlockSlave


class LeeChoi2018(BlockSlave):
    where = "imufmu.estimators.leechoi2018:BLOCK"
