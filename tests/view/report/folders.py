"""Folders of runs with made-up motion, written by the parts that write real ones; the solver is not needed."""

import base64
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from blocksim.scenario import Model, Scenario, load_scenario
from blocksim.simulation import files
from blocksim.simulation.balance import EnergyLedger
from blocksim.simulation.files import keep_scenario, read_tables
from blocksim.simulation.instruments import Frame, Recorder
from blocksim.simulation.results import Summary
from blocksim.simulation.stores.hdf5 import FrameFile, read_frames
from blocksim.simulation.trajectory import CONTACT_ROW, SUPPORT, Frames, Rows, csv_text, final_columns

SCENARIOS = Path(__file__).parents[3] / "scenarios"
LEDGER = ("kinetic", "potential", "friction")
TIME_STEP = 1e-3


def write_run(
    folder: Path, name: str = "three_blocks", count: int = 21, overrides: Mapping[str, object] | None = None
) -> Frames:
    """Write a finished run of a shipped scenario with `count` frames and return them."""
    scenario = load_scenario(SCENARIOS / f"{name}.toml", dict(overrides or {}))
    folder.mkdir(parents=True)
    keep_scenario(scenario, read_tables(scenario), folder)
    write_frames(folder / files.FRAMES, scenario, count)
    frames = read_frames(folder / files.FRAMES, Model(scenario))
    (folder / files.FINAL).write_text(csv_text(final_columns(frames)), encoding="utf-8")
    (folder / files.SUMMARY).write_text(summary_of(scenario.name, count).to_json(), encoding="utf-8")
    (folder / files.DONE).write_text('{"run": "made-up", "status": "finished"}', encoding="utf-8")
    return frames


def write_frames(path: Path, scenario: Scenario, count: int) -> None:
    """Write frames in which every block but the first goes its own way and turns."""
    placed = Model(scenario).bodies
    start = np.array([[body.x, body.y, body.angle, 0.0, 0.0, 0.0] for body in placed]).T
    numbers = np.arange(len(placed)) / len(placed)
    speed = np.array([0.5 * numbers, 0.2 * numbers, -4.0 * numbers])
    contacts = scenario.output.contacts
    with FrameFile(path, Recorder(placed, 1.0, TIME_STEP, contacts=contacts), "", LEDGER) as file:
        for step in range(count):
            motion = start.copy()
            motion[:3] += speed * step * TIME_STEP * 10.0
            motion[3:] = 10.0 * speed
            measured = np.array([0.1 * step, 5.0 - 0.1 * step, 0.0, 4.0, 1e-5])
            file.append(Frame(10 * step, (motion,), measured, contacts_of(motion) if contacts else None))


def contacts_of(motion: NDArray[np.float64]) -> Rows:
    """Return four contacts of every block with the ground below its centre, 2 N upwards each."""
    rows = np.zeros(4 * motion.shape[1], CONTACT_ROW)
    rows["body_a"], rows["body_b"] = np.arange(len(rows)) // 4, SUPPORT
    rows["x"], rows["normal_y"], rows["normal_force"] = np.repeat(motion[0], 4), 1.0, 2.0
    return rows


def summary_of(name: str, count: int) -> Summary:
    """Return a summary with made-up numbers."""
    return Summary(
        name=name,
        status="finished",
        reason="at rest",
        exit_code=0,
        run="0123456789ab",
        scenario_hash="5c" * 32,
        final_state_sha256="f1" * 32,
        steps=10 * count,
        time_step_s=TIME_STEP,
        simulated_time_s=10 * count * TIME_STEP,
        ended_at="2020-02-20T20:20:20+00:00",
        compile_seconds=0.0,
        solver_seconds=0.5,
        total_seconds=0.6,
        energy_J=EnergyLedger(kinetic=0.1, potential=4.9, friction=0.0, start=5.0, in_play=1.0),
        warnings=(),
        environment={"blocksim": "0.1.0"},
    )


def write_sweep(folder: Path, cases: int = 6, kept: int = 2, *, planned: bool = False) -> None:
    """Write a sweep over two keys, with its plan if asked; the first `kept` members have folders with frames."""
    folder.mkdir(parents=True)
    if planned:
        vary = {"friction.block_block.kinetic": [0.1, 0.2, 0.3], "contact.restitution": [0.1, 0.3]}
        overrides = {"sweep": {"vary": vary}, "experiment": None}
        scenario = load_scenario(SCENARIOS / "three_blocks.toml", overrides)
        keep_scenario(scenario, read_tables(scenario), folder)
        (folder / files.SCENARIO).rename(folder / "sweep.toml")
    lines = ["case,friction.block_block.kinetic,contact.restitution,status,reason,seconds,inside,1.x_mm,1.rotation_deg"]
    for number in range(cases):
        case, x = f"{number:012x}", 70.0 - number
        failed = number == cases - 1
        outcome = "failed,overlap,0.5,,," if failed else f"finished,at rest,0.5,{number % 2 == 0},{x},-90.0"
        lines.append(f"{case},{0.1 * (number % 3) + 0.1:.1f},{0.2 * (number // 3) + 0.1:.1f},{outcome}")
        if number < kept:
            write_run(folder / "cases" / case, count=5)
    (folder / "sweep.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_experiment(path: Path) -> None:
    """Write repeats of the block that `write_sweep` tells of: three of its five finished members are inside."""
    rows = [f"1,{name},{value}" for name, value in (("x,mm,1", 67.0), ("x,mm,2", 69.0), ("rotation,deg,1", -90.0))]
    path.write_text("\n".join(["block,quantity,unit,replicate,value", *rows]) + "\n", encoding="utf-8")


def numbers(part: Mapping[str, object]) -> NDArray[np.float64]:
    """Return the numbers that a page reads from text."""
    data = base64.b64decode(str(part["data"]))
    if part["type"] == "f4":
        return np.frombuffer(data, "<f4").astype(float)
    return float(str(part["low"])) + float(str(part["step"])) * np.frombuffer(data, "<u2")
