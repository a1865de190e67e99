"""Hosts of others, each run as a program: python foreign_hosts.py HOST < request > values.

The request is JSON: ``file``, an FMU or an SSP; ``start``, values of inputs by name; ``steps`` of ``h`` (s); ``names``
of the Real variables wanted at the end. The answer is their values, in the last line. A host that crashes takes only
this process with it.
"""

from __future__ import annotations

import json
import sys
import tempfile
import zipfile
from pathlib import Path

INSTANCE = "fmu"  # name of the only instance where the file is an FMU


def run_fmpy(file: Path, start: dict[str, float], steps: int, h: float, names: list[str]) -> list[float]:
    """FMPy's ``simulate_fmu``; names without the instance's. Its ``simulate_ssp`` applies no parameters of an SSP."""
    import fmpy

    own = len(f"{INSTANCE}.")
    result = fmpy.simulate_fmu(
        str(file),
        start_values={name[own:]: value for name, value in start.items()},
        stop_time=steps * h,
        step_size=h,
        output_interval=h,
        output=[name[own:] for name in names],
    )
    assert len(result) == steps + 1
    return [float(result[name[own:]][-1]) for name in names]


def run_libcosim(file: Path, start: dict[str, float], steps: int, h: float, names: list[str]) -> list[float]:
    """libcosim, by libcosimpy; it reads the parameters of an SSP itself."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    log_output_level(CosimLogLevel.WARNING)
    nanoseconds = round(1e9 * h)
    with tempfile.TemporaryDirectory() as folder:
        if file.suffix == ".ssp":
            zipfile.ZipFile(file).extractall(folder)
            execution = CosimExecution.from_ssp_file(str(Path(folder) / "SystemStructure.ssd"), nanoseconds)
        else:
            execution = CosimExecution.from_step_size(nanoseconds)
            slave = CosimLocalSlave(str(file), INSTANCE)
            execution.add_local_slave(slave)
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer)
        places = {}
        for info in execution.slave_infos():
            for variable in execution.slave_variables(info.index):
                places[f"{info.name.decode()}.{variable.name.decode()}"] = info.index, variable.reference
        if file.suffix == ".fmu":
            for name, value in start.items():
                assert execution.real_initial_value(*places[name], value)
        assert execution.step(steps)
        values = []
        for name in names:
            index, reference = places[name]
            values += observer.last_real_values(index, [reference])
        return values


def run_ecos(file: Path, start: dict[str, float], steps: int, h: float, names: list[str]) -> list[float]:
    """ecos, by ecospy; of an SSP it applies the parameter sets of one name."""
    from ecospy.EcosSimulation import EcosSimulation
    from ecospy.EcosSimulationStructure import EcosSimulationStructure

    if file.suffix == ".ssp":
        simulation = EcosSimulation(step_size=h, ssp_path=str(file))
    else:
        structure = EcosSimulationStructure()
        structure.add_model(INSTANCE, str(file))
        simulation = EcosSimulation(step_size=h, structure=structure)
    with simulation:
        for name, value in start.items():
            simulation.set_real(name.replace(".", "::", 1), value)
        assert simulation.init(parameter_set="parameters")
        simulation.step(steps)
        return [simulation.get_real(name.replace(".", "::", 1)) for name in names]


HOSTS = {"fmpy": run_fmpy, "libcosim": run_libcosim, "ecos": run_ecos}


if __name__ == "__main__":
    request = json.load(sys.stdin)
    answer = HOSTS[sys.argv[1]](Path(request.pop("file")), **request)
    print("\n" + json.dumps(answer), flush=True)
