"""FMU of the inertial measurement unit with the errors of real devices."""

from imufmu.fmi.slave import BlockSlave
from imufmu.sensors import imu


class Imu(BlockSlave):
    block = imu.BLOCK
