"""FMU of the car with a driver."""

from imufmu.fmi.slave import BlockSlave
from imufmu.plants import vehicle


class Vehicle(BlockSlave):
    block = vehicle.BLOCK
