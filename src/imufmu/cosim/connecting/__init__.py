"""A plant of others, wired to an IMU and estimators: what it offers is found by names, units and sizes."""
