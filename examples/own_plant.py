"""Your own plant with our IMU and estimator: a rocking platform. Its output `vertical` is taken for the truth."""

from itertools import pairwise, product
from math import cos, pi, sin
from pathlib import Path
from tempfile import TemporaryDirectory

from pythonfmu import Fmi2Causality, Fmi2Slave, Real
from pythonfmu.builder import FmuBuilder

HEIGHT, SWING, RATE, G = 0.5, 0.35, 2 * pi * 0.5, 9.80665  # m above the axle, rad, rad/s, m/s2
SSP = "http://ssp-standard.org/SSP1/SystemStructureDescription"
OUT, FMU = Fmi2Causality.output, "application/x-fmu-sharedlibrary"


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


IDEAL, READINGS = ("angular_velocity", "specific_force"), ("gyro", "accel")
# Component, FMU, inputs, outputs. imu and lee2012 are blocks of imufmu: they are built where they are missing.
CHAIN = [("plant", "RockingPlatform", (), IDEAL), ("imu", "imu", IDEAL, READINGS), ("lee2012", "lee2012", READINGS, ())]


def system():
    xml = f'<SystemStructureDescription xmlns="{SSP}" version="1.0" name="rock"><System name="rock"><Elements>'
    for name, fmu, inputs, outputs in CHAIN:
        ends = [(s, "input") for s in inputs] + [(s, "output") for s in outputs]
        xml += f'<Component name="{name}" source="{fmu}.fmu" type="{FMU}"><Connectors>'
        xml += "".join(f'<Connector name="{s}[{k}]" kind="{kind}"/>' for s, kind in ends for k in (1, 2, 3))
        xml += "</Connectors></Component>"
    xml += "</Elements><Connections>"
    for (a, *_, outputs), (b, *_) in pairwise(CHAIN):
        for x in (f"{signal}[{k}]" for signal in outputs for k in (1, 2, 3)):
            xml += f'<Connection startElement="{a}" startConnector="{x}" endElement="{b}" endConnector="{x}"/>'
    return xml + "</Connections></System></SystemStructureDescription>"


if __name__ == "__main__":
    from imufmu import comparisons, simulate

    with TemporaryDirectory() as folder:
        FmuBuilder.build_FMU(__file__, dest=folder)
        Path(folder, "platform.ssd").write_text(system())
        result = simulate(f"{folder}/platform.ssd", stop_time=20.0, step=0.01, parameters={"lee2012.g": G})
    print(f"tilt RMSE {comparisons(result)[0].summary['tilt_rmse_deg']:.2f} deg")
