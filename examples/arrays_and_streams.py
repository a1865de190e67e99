"""The same filter without FMUs: a whole record in one call, and sample by sample."""

import numpy as np

from imufmu import Stream, lee2012, run

rng = np.random.default_rng(1)
gyro = rng.normal(0.0, 0.01, (500, 3))  # rad/s, at rest
accel = rng.normal((0.0, 0.0, 9.8), 0.01, (500, 3))  # m/s2
parameters = {"sample_period": 0.005, "c_a": 0.1}

record = run(lee2012, {"gyro": gyro, "accel": accel}, parameters)

stream = Stream(lee2012, parameters)
for w, f in zip(gyro, accel, strict=True):
    now = stream.update(gyro=w, accel=f)

print(f"roll {np.degrees(now['roll']):.4f} deg, one-sigma tilt {np.degrees(now['tilt_std']):.4f} deg")
assert now["roll"] == record["roll"][-1]
