"""FMU of the gravity-direction Kalman filter of Lee, Park and Robinovitch (2012)."""

from imufmu.fmi.slave import BlockSlave


class Lee2012(BlockSlave):
    where = "imufmu.estimators.lee2012:BLOCK"
