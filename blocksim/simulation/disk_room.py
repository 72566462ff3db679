"""Room on the disk for what a run may leave: more than there is would end it with all that it has computed."""

import shutil
from pathlib import Path

from blocksim.errors import OutputError
from blocksim.scenario import Scenario
from blocksim.simulation.folder import CHECKPOINTS
from blocksim.simulation.loop import last_step_of
from blocksim.simulation.probe_series import bytes_of_series
from blocksim.simulation.schemes import AnyScene, ledger_names
from blocksim.world.free_memory import readable
from blocksim.world.memory import output_count, recorded_contacts, run_bytes
from blocksim.world.scenes import arrays_of
from blocksim.world.systems import others_of

CHECKPOINT_FILES = len(CHECKPOINTS) + 1  # the last one while it is written


def refuse_full_disk(folder: Path, scenario: Scenario, scene: AnyScene) -> None:
    """Raise OutputError where a run may leave more than there is room for on the disk of a folder (yet to be made)."""
    needed = bytes_needed(scenario, scene)
    place = next(path for path in (folder.absolute(), *folder.absolute().parents) if path.exists())
    free = shutil.disk_usage(place).free
    if needed > free:
        raise OutputError(
            f"{folder}: the results may take {readable(needed)}, but only {readable(free)} are free there; write "
            "elsewhere with --out DIR, or store fewer frames (output.every, time.end)"
        )


def bytes_needed(scenario: Scenario, scene: AnyScene) -> int:
    """Return the bytes that the frames of a run and its checkpoints take at most."""
    steps = last_step_of(scenario.time.end, float(scene.world.controls[0].step))
    frames = output_count(steps, scenario.time.end, scenario.output.every) + 2  # the first, and wherever it ends
    bodies, particles = scene.world.bodies.size - 1, scene.world.particles
    contacts = recorded_contacts(bodies, 0 if particles is None else particles.size) if scenario.output.contacts else 0
    arrays = sum(array.nbytes for array in arrays_of(scene))
    step = float(scene.world.controls[0].step)
    series = bytes_of_series(scenario, steps, step, len(ledger_names(scene)))
    return series + run_bytes(bodies, frames, contacts, others_of(scenario)) + CHECKPOINT_FILES * arrays
