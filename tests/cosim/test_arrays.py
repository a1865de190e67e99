"""Arrays are connected as a whole where a description does so, as SSP 2.0 has it, through systems and between FMUs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import imufmu
from imufmu import System, WiringError
from support.cosim_stubs import fake_fmu, variable
from support.rocker import rocker

HEAD = (
    '<SystemStructureDescription xmlns="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="2.0" name="arrays"><System name="arrays">'
)
TAIL = '</System><DefaultExperiment startTime="0" stopTime="1"/></SystemStructureDescription>'


def connector(name: str, kind: str) -> str:
    return f'<Connector name="{name}" kind="{kind}"><ssc:Float64/><ssc:Dimension size="3"/></Connector>'


def component(name: str, source: str, *connectors: str) -> str:
    return f'<Component name="{name}" source="{source}"><Connectors>{"".join(connectors)}</Connectors></Component>'


def connection(start: str, end: str) -> str:
    ends = []
    for which, text in (("start", start), ("end", end)):
        element, _, name = text.rpartition(".")
        ends.append((f'{which}Element="{element}" ' if element else "") + f'{which}Connector="{name}"')
    return f"<Connection {' '.join(ends)}/>"


def system(path: Path, elements: list[str], connections: list[str]) -> Path:
    path.write_text(
        f"{HEAD}<Elements>{''.join(elements)}</Elements><Connections>{''.join(connections)}</Connections>{TAIL}"
    )
    return path


IMU = component("imu", "imu.fmu", connector("angular_velocity", "input"), connector("specific_force", "input"))


def test_an_array_goes_to_a_vector_of_fmi_2_as_a_whole(tmp_path: Path) -> None:
    plant = component(
        "plant", str(rocker("3_cs")), connector("angular_velocity", "output"), connector("specific_force", "output")
    )
    wires = [connection(f"plant.{name}", f"imu.{name}") for name in ("angular_velocity", "specific_force")]
    read = System.read(system(tmp_path / "s.ssd", [plant, IMU], wires))
    assert not [note for note in read.notes if "Dimension" in note]
    result = imufmu.simulate(read, in_process=True, step=0.01)
    np.testing.assert_array_equal(result["imu.gyro"][:-1], result["plant.angular_velocity"][:-1])
    np.testing.assert_array_equal(result["imu.accel"][:-1], result["plant.specific_force"][:-1])


def test_an_array_goes_through_systems_and_elements_keep_their_order(tmp_path: Path) -> None:
    """From an FMU that counts from 0, by a system inside and its connector, to one that counts from 1."""
    fake_fmu(tmp_path / "source.fmu", [variable(f"w[{i}]", "output") for i in range(3)])
    inner = (
        f'<System name="inner"><Connectors>{connector("rates", "output")}</Connectors><Elements>'
        f"{component('source', 'source.fmu', connector('w', 'output'))}</Elements>"
        f"<Connections>{connection('source.w', 'rates')}</Connections></System>"
    )
    read = System.read(system(tmp_path / "s.ssd", [inner, IMU], [connection("inner.rates", "imu.angular_velocity")]))
    assert [str(link).replace(" [rad/s]", "") for link in read.links] == [
        f"inner.source.w[{i}] -> imu.angular_velocity[{i + 1}]" for i in range(3)
    ]


def test_arrays_of_different_sizes_are_refused(tmp_path: Path) -> None:
    plant = component("plant", str(rocker("3_cs")), connector("push", "input"), connector("vertical", "output"))
    path = system(tmp_path / "s.ssd", [plant], [connection("plant.vertical", "plant.push")])
    with pytest.raises(WiringError, match=r"plant\.vertical -> plant\.push: an array of 3 elements and one of 2"):
        System.read(path)
