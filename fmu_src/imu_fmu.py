"""FMU of the inertial measurement unit with the errors of real devices."""

from imufmu.fmi.slave import BlockSlave


class Imu(BlockSlave):
    where = "imufmu.sensors.imu:BLOCK"
