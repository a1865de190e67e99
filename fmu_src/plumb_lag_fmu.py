"""FMU of plumb_lag, the fixed-lag smoother behind plumb."""

from imufmu.fmi.slave import BlockSlave


class PlumbLag(BlockSlave):
    where = "imufmu.estimators.plumb:LAGGED"
