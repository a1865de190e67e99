"""Hosts of others get our numbers from our FMUs and systems: pip install -e ".[hosts]", and this file with pytest.

FMPy is always there; libcosim and ecos take part where they are installed. ecos needs libtbb12 on Debian.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from imufmu import System, locate, pack, simulate
from imufmu.blocks.block import ContinuousBlock
from imufmu.blocks.instance import instantiate
from imufmu.files.locations import models_folder
from imufmu.registry import BLOCKS
from support import fmu
from support.foreign_hosts import HOSTS, INSTANCE
from support.optional import missing
from support.places import ROOT

STEPS, H = 50, 0.01
SYSTEMS = sorted(path.stem for path in models_folder().rglob("*.ssd"))


@pytest.fixture(params=HOSTS)
def host(request: pytest.FixtureRequest) -> str:
    if missing(request.param):  # asked only when its turn comes: it takes seconds
        pytest.skip(f"{request.param}: {missing(request.param)}")
    return str(request.param)


def ask(host: str, file: Path, start: dict[str, float], names: list[str], h: float = H) -> list[float]:
    """Values of the variables after STEPS steps in a host."""
    request = {"file": str(file), "start": start, "steps": STEPS, "h": h, "names": names}
    program = ROOT / "tests" / "support" / "foreign_hosts.py"
    done = subprocess.run(
        [sys.executable, str(program), host], input=json.dumps(request), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return list(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.parametrize("kind", fmu.KINDS)
@pytest.mark.parametrize("name", BLOCKS)
def test_a_host_gets_the_numbers_of_the_run_in_process_from_each_fmu(name: str, kind: str, host: str) -> None:
    """With constant inputs, so that no host can delay them. Bit for bit, but plants see a time that hosts add up."""
    block = BLOCKS[name]
    instance = instantiate(block)
    within = [(v.signal.minimum, v.signal.maximum) for v in block.variables if v.group == "input"]
    instance.u[:] = [min(max(0.25 + 0.5 * i, least), most) for i, (least, most) in enumerate(within)]
    instance.initialise(0.0)
    for k in range(STEPS):
        instance.do_step(k * H, H)
    names = {group: [v.name for v in block.variables if v.group == group] for group in ("input", "output")}
    inputs = {f"{INSTANCE}.{n}": value for n, value in zip(names["input"], instance.u.tolist(), strict=True)}
    outputs = [f"{INSTANCE}.{n}" for n in names["output"]]
    actual, expected = np.array(ask(host, fmu.path(name, kind), inputs, outputs)), instance.y[: len(outputs)]
    if isinstance(block, ContinuousBlock):
        # 50 additions lose 1e-15 s; motions turn and accelerate by some 100 per second (rad, m/s2, uT).
        np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-12)
    else:
        assert actual.tolist() == expected.tolist()


@pytest.mark.parametrize("kind", fmu.KINDS)
@pytest.mark.parametrize("system", SYSTEMS)
def test_a_host_gets_the_numbers_of_our_master_from_each_system(
    system: str, kind: str, host: str, tmp_path: Path
) -> None:
    """These hosts take all inputs before a step, as ours does where it is told to.

    Bit for bit where their time is ours; where they round or add it up, within the project's bound between backends.
    """
    if host == "fmpy":
        pytest.skip("its simulate_ssp applies no parameters and starts from inputs of 0; our master is built on FMPy")
    file = pack(locate(system), tmp_path / "system.ssp", native=kind == "native")
    ours = System.read(file)
    h = ours.description.step or H
    if host == "libcosim":
        h = round(1e9 * h) / 1e9  # it counts nanoseconds
    expected = simulate(ours, stop_time=STEPS * h, step=h, jacobi=True)
    plants = {c.name for c in ours.description.components if isinstance(BLOCKS.get(c.source.stem), ContinuousBlock)}
    # After its last step a host holds a plant's values of that time, and samples of the time before.
    wanted = {name: expected[name][-1 if name.split(".")[0] in plants else -2] for name in expected.names}
    actual = ask(host, file, {}, list(wanted), h)
    np.testing.assert_allclose(actual, list(wanted.values()), rtol=1e-12, atol=1e-12)
