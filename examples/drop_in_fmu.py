"""Drop lee2012.fmu into FMPy: a board that lies still and is then tilted by 30 degrees."""

from pathlib import Path
from tempfile import TemporaryDirectory

import fmpy
import numpy as np

from imufmu import build_fmu

time = np.arange(0.0, 4.0, 0.01)
roll = np.radians(30) * np.clip(time - 1.0, 0.0, 1.0)  # one second of turning about x, from 1 s on

names = ["gyro[1]", "gyro[2]", "gyro[3]", "accel[1]", "accel[2]", "accel[3]"]
readings = np.zeros(len(time), dtype=[("time", float)] + [(name, float) for name in names])
readings["time"] = time
readings["gyro[1]"] = np.gradient(roll, time)
readings["accel[2]"], readings["accel[3]"] = 9.8 * np.sin(roll), 9.8 * np.cos(roll)

with TemporaryDirectory() as folder:
    fmu = build_fmu("lee2012", Path(folder))
    result = fmpy.simulate_fmu(
        str(fmu), stop_time=4.0, input=readings, start_values={"c_a": 0.2}, output=["roll", "pitch", "tilt_std"]
    )

print(f"roll at the end: {np.degrees(result['roll'][-1]):.2f} deg, expected 30")
assert abs(np.degrees(result["roll"][-1]) - 30) < 0.1
