"""What it takes to know, years later, what a number came from."""

import hashlib
import os
import platform
import sys
from importlib import metadata

from blocksim.kernels.arrays import World
from blocksim.kernels.jit import source_hash
from blocksim.scenario import Scenario, scenario_hash

PACKAGES = ("numpy", "numba", "pydantic", "h5py", "pandas")
HASH_DIGITS = 12


def code_version() -> str:
    """Return the version of the installed package."""
    return metadata.version("blocksim")


def run_hash(scenario: Scenario) -> str:
    """Return the name of a run: a hash of everything that decides its bits, scenario and code."""
    text = f"{scenario_hash(scenario)} {code_version()} {source_hash()}"
    return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]


def state_hash(world: World) -> str:
    """Return a hash of the bits of all positions and velocities."""
    digest = hashlib.sha256()
    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        digest.update(world.bodies[name][:-1].tobytes())
    return digest.hexdigest()


def environment() -> dict[str, str]:
    """Return versions and machine."""
    versions = {name: metadata.version(name) for name in PACKAGES}
    return {
        "blocksim": code_version(),
        "kernel_source": source_hash(),
        "python": platform.python_version(),
        **versions,
        "platform": platform.platform(),
        "processor": _processor(),
        "cores": str(os.cpu_count()),
        "command": " ".join(sys.argv),
    }


def _processor() -> str:
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:  # noqa: PTH123 - a device, not a path of ours
            names = [line.partition(":")[2].strip() for line in file if line.startswith("model name")]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()
