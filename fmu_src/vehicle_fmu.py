"""FMU of the car with a driver."""

from imufmu.fmi.slave import BlockSlave


class Vehicle(BlockSlave):
    where = "imufmu.plants.vehicle:BLOCK"
