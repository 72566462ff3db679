"""One run, kept in a folder or in memory."""

from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from blocksim.errors import InvalidInputError, OutputError, OutputExistsError
from blocksim.options import Option, Overwrite, silent, takes
from blocksim.scenario import Model, Source
from blocksim.simulation import Result, Watcher, checkpoint, files, read_result, renew_copies, simulate, simulate_into
from blocksim.simulation.results import RESULT_FILES, changed_files, read_summary
from blocksim.simulation.run import NO_CALLBACKS, RunCallbacks
from blocksim.study import rows, run_folder

Threads = Annotated[
    int,
    Option("Threads, for scenes of 200 blocks and more. Results are bit-identical.", metavar="N", least=1),
]


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """Where a run is kept, and how it is executed, none of which changes its bits."""

    out: Annotated[
        Path | str | None,
        Option(
            "Folder for the results (default: results/NAME/HASH).",
            python="Folder for the results (default: none, in memory only).",
            metavar="DIR",
        ),
    ] = None
    overwrite: Overwrite = False
    resume: Annotated[bool, Option("Resume a run that was stopped or killed.")] = False
    precautions: checkpoint.CheckpointPolicy = checkpoint.DEFAULTS
    threads: Threads = 1
    on_progress: Watcher = silent
    listener: RunCallbacks = NO_CALLBACKS


@takes(RunOptions)
def run(scenario: Source, options: RunOptions) -> Result:
    """Simulate a scenario and return the result; with `out` it is kept in that folder as well.

    A folder that holds the finished run of exactly this scenario and code is read instead, unless `overwrite` is
    given. With `resume` a run that was interrupted there continues, to the same bits as without the interruption. The
    result does not depend on the number of threads, nor on `precautions`, which say when checkpoints are written and
    after which wall time to stop. `listener` hears what happens before the first step. Ctrl-C returns what was computed
    until then, with the status `interrupted`. Raises ScenarioError, InvalidInputError for an experiment table that does
    not go with the blocks, for more threads than the system has, for a checkpoint of another scenario or version of the
    code and for results that have been changed or cut since, OutputExistsError, OutputError; ValueError for `resume`
    with `overwrite` or without `out`.

    >>> run(load("scenarios/slide.toml", {"contact.stiffness_scale": 0.001})).final["x_mm"].round(1).tolist()
    [33.5]
    """
    out, overwrite, resume, threads = options.out, options.overwrite, options.resume, options.threads
    precautions, on_progress = options.precautions, options.on_progress
    if resume and (overwrite or out is None):
        raise ValueError("resume needs out=FOLDER, and cannot be combined with overwrite")
    model = Model(scenario)
    rows.check_experiment(model)
    if out is None:
        return simulate(model, threads=threads, on_progress=on_progress, wall_time=precautions.wall_time)
    folder = Path(out)
    if not overwrite and files.holds_run(folder, model):
        changed = changed_files(folder, read_summary(folder / files.SUMMARY), RESULT_FILES)
        if changed:
            path = folder / changed[0]
            what = "does not have the checksum in run.json" if path.is_file() else "no such file"
            raise InvalidInputError(f"{path}: {what}: changed since the run; rerun with --overwrite")
        with suppress(OutputExistsError, OutputError), files.folder_lock(folder):  # it was killed right after its end
            files.clear_remains(folder, files.CHECKPOINTS)
        renew_copies(model.scenario, folder)
        result = read_result(folder)
        options.listener.on_remark(f"already computed; rerun with --overwrite: {folder}")
        return result
    return simulate_into(
        model,
        folder,
        overwrite=overwrite,
        resume=resume,
        threads=threads,
        precautions=precautions,
        on_progress=on_progress,
        listener=options.listener,
    )


def open_run(place: Path | str) -> Result:
    """Return a stored run: a run folder, `results/NAME` (its newest finished run) or a scenario file that has been run.

    Raises InputMissingError where there is none and InvalidInputError for a damaged one.

    >>> kept = run(load("scenarios/slide.toml", {"contact.stiffness_scale": 0.001}), out="results/kept")
    >>> open_run("results/kept").summary.steps == kept.summary.steps
    True
    """
    return read_result(run_folder.find_run(place))
