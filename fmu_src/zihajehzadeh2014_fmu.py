"""FMU of the cascade of tilt and yaw Kalman filters of Zihajehzadeh et al. (2014)."""

from imufmu.fmi.slave import BlockSlave


class Zihajehzadeh2014(BlockSlave):
    where = "imufmu.estimators.zihajehzadeh2014:BLOCK"
