"""python -m tests.plan.states FILE: hashes of what blocksim answers, to be compared before and after code is moved.

    python -m tests.plan.states FILE [--compare] [--only WORDS]

Runs all shipped scenarios, the models and laws of contact, studies of every kind and the verification cases by the
command line, and writes a hash of each answer into FILE (JSON): the final state of runs, the tables of studies, the
numbers of verification cases with all digits. With `--compare` nothing is written; what differs from FILE is named,
and the exit code is 1. Hashes hold for one processor and one set of versions only, so none are kept with the code:
write them with the commit that is to be changed, and compare on the same machine.
"""

import argparse
import hashlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).parents[2]
BLOCKSIM = str(Path(sys.executable).with_name("blocksim"))
SCENARIOS = ROOT / "scenarios"
NOT_RUN = {"sweep_friction_stiffness", "sweep_readings", "ensemble_three_blocks", "start_jitter", "stiffness_levels"}
JOBS = 2
SKIPPED_FIELDS = {"seconds", "wall_s", "cpu_s"}  # of verification cases

Command = tuple[str, ...]
THREE = "scenarios/three_blocks.toml"
RIGID = "scenarios/three_blocks_nonsmooth.toml"
WALL = "scenarios/tilting_wall.toml"
FRICTION = "friction.block_block"
STUDIES: dict[str, Command] = {
    "sweep": ("sweep", THREE, "--vary", f"{FRICTION}.kinetic=0.15,0.2", "--vary", "contact.stiffness_scale=0.001,0.01"),
    "sweep-rigid": ("sweep", RIGID, "--vary", f"{FRICTION}=0.2:0.4:9", "--vary", "contact.restitution=0,0.2,0.4"),
    "sweep-jitter": ("sweep", "scenarios/start_jitter.toml"),
    "limit": ("limit", WALL, "--vary", "ground.tilt=30deg:35deg:3", "--to", "1%"),
    "limit-rigid": ("limit", WALL, "--set", "time.scheme=nonsmooth", "--vary", "ground.tilt=20deg:40deg"),
    "limit-arch": ("limit", "scenarios/arch.toml", "--vary", "structures.0.thickness=1m:2.1m", "--to", "1%"),
    "fragility": ("fragility", WALL, "--set", "time.scheme=nonsmooth", "--intensity", "ground.tilt=32deg,33deg",
                  "--scatter", f"{FRICTION}=0.6:0.7", "--members", "8"),
    "sensitivity": ("sensitivity", "scenarios/ensemble_three_blocks.toml", "--samples", "4"),
}  # fmt: skip


def commands() -> Iterator[tuple[str, Command]]:
    """Yield a name and the arguments of every command whose answer is hashed."""
    for file in sorted(SCENARIOS.rglob("*.toml")):
        if file.stem not in NOT_RUN:
            yield f"run {file.relative_to(SCENARIOS).with_suffix('')}", ("run", str(file))
    for model in ("surface", "particles", "kernel"):
        for law in ("linear", "hertz-mindlin"):
            values = (f"contact.model={model}", f"contact.law={law}", "contact.stiffness_scale=0.001")
            yield f"run {model} {law}", ("run", str(ROOT / THREE), *(part for one in values for part in ("--set", one)))
            yield f"verify {model} {law}", ("verify", "--quick", "--model", model, "--law", law)
    yield "verify rigid", ("verify", "--scheme", "nonsmooth")
    yield "verify soil", ("verify", "--soil", "--quick")
    for name, (command, path, *options) in STUDIES.items():
        yield f"study {name}", (command, str(ROOT / path), *options)


def _numbers(value: object) -> object:
    """Return an answer in JSON without what depends on the clock."""
    if isinstance(value, dict):
        return {name: _numbers(one) for name, one in value.items() if name not in SKIPPED_FIELDS}
    return [_numbers(one) for one in value] if isinstance(value, list) else value


def answer_of(arguments: Command, folder: Path) -> str:
    """Return the hash of what a command answers, or its message where it fails."""
    command, *_ = arguments
    extra = (
        ("--json",)
        if command == "verify"
        else ("--quiet", "--out", str(folder / ("a.csv" if command == "sensitivity" else "out")))
    )
    done = subprocess.run(
        [BLOCKSIM, *arguments, *extra],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    if command == "verify":
        return _digest(json.dumps(_numbers(json.loads(done.stdout or "null")), sort_keys=True))
    summaries = [] if command != "run" else sorted(folder.rglob("run.json"))
    if summaries:
        return str(json.loads(summaries[0].read_text(encoding="utf-8"))["final_state_sha256"])
    tables = [
        path for path in sorted(folder.rglob("*.csv")) if path.name != "timings.csv" and "cases" not in path.parts
    ]
    if not tables:
        return f"exit {done.returncode}: {done.stderr.strip().splitlines()[-1:]}"
    return _digest("\n".join(path.read_text(encoding="utf-8") for path in tables))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def hashes(words: str) -> dict[str, str]:
    """Return the hashes of all commands whose name has some words."""
    chosen = {name: arguments for name, arguments in commands() if words in name}

    def one(arguments: Command) -> str:
        with tempfile.TemporaryDirectory() as folder:
            return answer_of(arguments, Path(folder))

    with ThreadPoolExecutor(JOBS) as pool:
        found = {}
        for name, value in zip(chosen, pool.map(one, chosen.values()), strict=True):
            found[name] = value
            sys.stdout.write(f"{value[:60]:60} {name}\n")
            sys.stdout.flush()
    return found


def main() -> int:
    """Write or compare hashes."""
    parser = argparse.ArgumentParser(description="Hash what blocksim answers.")
    parser.add_argument("file", type=Path)
    parser.add_argument("--compare", action="store_true")
    parser.add_argument("--only", default="", help="words in the names of commands")
    asked = parser.parse_args()
    found = hashes(asked.only)
    if not asked.compare:
        asked.file.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        return 0
    stored = json.loads(asked.file.read_text(encoding="utf-8"))
    differing = [name for name, value in found.items() if stored.get(name) != value]
    sys.stdout.write("".join(f"differs: {name}\n" for name in differing) or "all as stored\n")
    return int(bool(differing))


if __name__ == "__main__":
    sys.exit(main())
