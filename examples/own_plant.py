"""Your own plant with our IMU and estimator: a rocking platform. Its output `vertical` is taken for the truth."""

from itertools import product
from math import cos, pi, sin
from pathlib import Path
from tempfile import TemporaryDirectory

from pythonfmu import Fmi2Causality, Fmi2Slave, Real
from pythonfmu.builder import FmuBuilder

HEIGHT, SWING, RATE, G = 0.5, 0.35, 2 * pi * 0.5, 9.80665  # m above the axle, rad, rad/s, m/s2
OUT = Fmi2Causality.output


class RockingPlatform(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.do_step(0.0, 0.0)
        for n, k in product(self.signals, range(3)):
            self.register_variable(Real(f"{n}[{k + 1}]", causality=OUT, getter=lambda n=n, k=k: self.signals[n][k]))

    def do_step(self, current_time, step_size):
        t = current_time + step_size
        angle, rate = SWING * sin(RATE * t), SWING * RATE * cos(RATE * t)
        up = (0.0, sin(angle), cos(angle))  # in the sensor, which turns about its x axis
        force = (0.0, HEIGHT * RATE**2 * angle + G * up[1], -HEIGHT * rate**2 + G * up[2])
        self.signals = {"angular_velocity": (rate, 0.0, 0.0), "specific_force": force, "vertical": up}
        return True


if __name__ == "__main__":
    from imufmu import System, comparisons, simulate

    with TemporaryDirectory() as folder:
        FmuBuilder.build_FMU(__file__, dest=folder)
        system = System.connect(Path(folder, "RockingPlatform.fmu"), "mtx", ["lee2012"], rate=100)
        result = simulate(system, stop_time=20.0, parameters={"lee2012.g": G})
    print(f"tilt RMSE {comparisons(result)[0].summary['tilt_rmse_deg']:.2f} deg")
