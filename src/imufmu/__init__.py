"""IMU attitude estimators as drop-in FMUs, with the plants, IMU models and validation runs to trust them."""

__version__ = "0.1.0"
