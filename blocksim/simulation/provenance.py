"""What a run came from: hashes of scenario, code and state, versions and machine."""

import functools
import hashlib
import os
import platform
import shlex
import sys
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from blocksim.scenario import Model
from blocksim.simulation.balance import solver_module

if TYPE_CHECKING:
    from blocksim.simulation.schemes import AnyScene

ROOMS = ("kernels", "scenario", "simulation", "world")  # their code decides the bits of a run
PACKAGES = ("numpy", "numba", "llvmlite", "pydantic", "h5py", "pandas")  # the first three compile or compute the bits
HASH_DIGITS = 12
ROOM_PREFIX = "code_"  # and a room: the hash of its code
CPU_INFO = Path("/proc/cpuinfo")


def code_version() -> str:
    """Return the version of the code that runs: that of an editable installation may be an older one."""
    return str(sys.modules["blocksim"].__version__)  # the package is no room to import from


@functools.cache
def code_hashes() -> dict[str, str]:
    """Return a hash of the code of each room that decides the bits of a run, with the versions it is compiled with."""
    jit, package = solver_module("kernels.common.jit"), Path(__file__).resolve().parents[1]
    return {room: jit.source_hash(package / room) for room in ROOMS}


@functools.cache
def code_hash() -> str:
    """Return one hash of all code that decides the bits of a run, and of the versions it is compiled with."""
    text = " ".join([code_version(), *code_hashes().values()])
    return hashlib.sha256(text.encode()).hexdigest()


def run_hash(model: Model) -> str:
    """Return the name of a run: a hash of everything that decides its bits, scenario and code."""
    text = f"{model.hash} {code_hash()}"
    return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]


def state_hash(scene: "AnyScene") -> str:
    """Return a hash of the bits of all positions and velocities, and of all arrays of further systems."""
    digest = hashlib.sha256()
    for name in ("x", "y", "angle", "vx", "vy", "spin"):
        digest.update(scene.world.bodies[name][:-1].tobytes())
    for system in getattr(scene, "systems", ()):
        for array in system:
            digest.update(array.tobytes())
    return digest.hexdigest()


def environment() -> dict[str, str]:
    """Return versions, machine and command; `cpu` and `cpu_features` are what machine code is compiled for."""
    from blocksim.kernels.common.compiler import cpu_target  # noqa: PLC0415 - which reading a folder does not need

    # by these numba names the files of what it has compiled
    _, cpu, features = cpu_target.target_context.codegen().magic_tuple()
    return {
        "blocksim": code_version(),
        "code": code_hash()[:HASH_DIGITS],
        **{f"{ROOM_PREFIX}{room}": digest for room, digest in code_hashes().items()},
        "python": platform.python_version(),
        **{name: metadata.version(name) for name in PACKAGES},
        "platform": platform.platform(),
        "processor": _processor(),
        "cpu": cpu,
        "cpu_features": " ".join(sorted(one[1:] for one in features.split(",") if one.startswith("+"))),
        "cores": str(os.cpu_count()),
        "command": shlex.join(sys.argv).encode(errors="backslashreplace").decode(),  # names may be no text
    }


def machine() -> str:
    """Return processor, system and its C library, whose sines may differ in the last digit, in one line."""
    parts = (_processor(), sys.platform, platform.machine(), *platform.libc_ver())
    return " ".join(part for part in parts if part)


def _processor() -> str:
    try:
        lines = CPU_INFO.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
