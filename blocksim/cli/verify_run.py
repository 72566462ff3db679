"""blocksim verify-run: check bitwise reproducibility of stored results."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import command_line
from blocksim.cli.output import note, show
from blocksim.cli.prepare import announce_compilation
from blocksim.cli.progress import run_progress
from blocksim.errors import BlocksimError, ExitCode, InputMissingError, StoppedEarlyError
from blocksim.scenario import load_stored
from blocksim.simulation.compilation import kernels_of
from blocksim.study.manifest import is_sweep
from blocksim.study.run import Threads
from blocksim.study.study import Study, study_in
from blocksim.study.sweep import kernels_for
from blocksim.study.sweep_folder import read_plan
from blocksim.study.verify_run import EntryDifference, Origin, RunVerdict, scenario_of, verify_run
from blocksim.study.verify_study import DEGREES, MM, SAMPLE, SweepVerdict, verify_study, verify_sweep

INDENT = "  "
MOST_CELLS = 5
MOST_ENTRIES = 5
LONGEST = 60  # characters of an entry of the provenance
MOST_WORDS = 12
UNITS = {"_mm": " mm", "_deg": "°", "_mm_s": " mm/s", "_deg_s": "°/s", "_J": " J", "_s": " s", "_m": " m", "_N": " N"}


@dataclass(frozen=True)
class VerificationReport:
    """Result for one place: for people, for programs, and the exit code."""

    lines: tuple[str, ...]
    data: dict[str, object]
    code: ExitCode


def verify_run_command(
    places: Annotated[
        list[Path],
        typer.Argument(
            metavar="DIR",
            help="Run folder, results/NAME (its newest finished run), scenario file, or folder of a sweep, "
            "limit or fragility study.",
        ),
    ],
    threads: Threads = 1,
    sample: Annotated[
        int, typer.Option(min=1, metavar="N", help="Number of rows of a sweep or study to run again.")
    ] = SAMPLE,
    seed: Annotated[int, typer.Option(min=0, metavar="S", help="Random seed for the choice of rows.")] = 0,
    as_json: command_line.Json = False,
    quiet: command_line.Quiet = False,
) -> None:
    """Run stored results again and check bitwise reproducibility.

    Of a run: checksums of all files, final state, every frame of run.h5, final.csv, and the steps, times, energies,
    movement and end in run.json. Of a sweep: the name of every case, and every cell of a sample of rows. Of limits and
    fragility studies: tables and answer, which are made again from the manifest, and a sample of runs. Exit code 1:
    something differs; the answer gives the first and the largest difference, and what has changed since: code,
    versions, processor. Nothing is written.

    Example: blocksim verify-run results/three_blocks
    """
    silent = quiet or as_json
    verified = [_verified(place, threads, sample, seed, silent=silent) for place in places]
    show((line for one in verified for line in one.lines), [one.data for one in verified], as_json=as_json)
    raise typer.Exit(max(one.code for one in verified))  # of several the most severe: 65, 66 before 1 before 0


def _verified(place: Path, threads: int, sample: int, seed: int, *, silent: bool) -> VerificationReport:
    """Verify one place; an error in it does not stop the others."""
    try:
        study = study_in(place)
        if study is not None:
            return _of_study(_repeat_study(place, study, sample, seed, silent=silent))
        if is_sweep(place):
            return _of_sweep(_sample_again(place, sample, seed, silent=silent))
        return _of_run(_run_again(place, threads, silent=silent), told=not silent)
    except StoppedEarlyError:
        raise
    except BlocksimError as error:
        note(str(error))
        kind = "missing" if isinstance(error, InputMissingError) else "damaged"
        data = {"agrees": False, "kind": kind, "folder": str(place), "error": str(error)}
        return VerificationReport((f"{place}: {kind}",), data, error.exit_code)


def _run_again(place: Path, threads: int, *, silent: bool) -> RunVerdict:
    announce_compilation(kernels_of(scenario_of(place)), quiet=silent)
    with run_progress(quiet=silent) as on_progress:
        return verify_run(place, threads=threads, on_progress=on_progress)


def _sample_again(folder: Path, sample: int, seed: int, *, silent: bool) -> SweepVerdict:
    for kernels in kernels_for(read_plan(folder)):
        announce_compilation(kernels, quiet=silent)
    return verify_sweep(folder, sample, seed)


def _repeat_study(folder: Path, study: Study, sample: int, seed: int, *, silent: bool) -> tuple[SweepVerdict, ...]:
    announce_compilation(kernels_of(load_stored(folder / study.answer.files.plan)), quiet=silent)
    return verify_study(folder, study, sample, seed)


def _of_study(verdicts: tuple[SweepVerdict, ...]) -> VerificationReport:
    """Report a study, of a curve of limits every search and then the curve."""
    found = [_of_sweep(one, "runs", "table and answer follow from the runs; ") for one in verdicts]
    agrees = all(one.agrees for one in verdicts)
    told: dict[str, object] = {**found[-1].data, "agrees": agrees, "kind": "study"}
    if len(found) > 1:
        told["searches"] = [one.data for one in found[:-1]]
        if verdicts[-1].agrees:
            found[-1] = replace(found[-1], lines=(f"{verdicts[-1].folder}: table and answer follow from the searches",))
    return VerificationReport(tuple(line for one in found for line in one.lines), told, ExitCode(not agrees))


def _of_run(verdict: RunVerdict, *, told: bool) -> VerificationReport:
    count = verdict.frames.frames[0]
    if verdict.agrees:
        lines = [f"{verdict.folder}: bit-identical: final state, {count} frames, final.csv"]
        if verdict.origins and told:
            note("\n".join(_told_origins(verdict.origins)))
    else:
        lines = [f"{verdict.folder}: differs", *(INDENT + line for line in _reasons(verdict))]
    return VerificationReport(tuple(lines), verdict.to_dict(), ExitCode(not verdict.agrees))


def _reasons(verdict: RunVerdict) -> Iterator[str]:
    """Report in what a run differs."""
    yield from (f"{name} was changed after the run (SHA-256 in run.json)" for name in verdict.changed)
    then, now = verdict.status
    if then != now:
        yield f"the stored run is {then}, the new one {now}"
    if not verdict.state:
        yield "the final state has another hash than in run.json"
    if not verdict.table:
        yield "final.csv differs"
    yield from _entries(verdict.entries)
    yield from _parting(verdict)
    yield from _told_origins(verdict.origins)


def _entries(found: Sequence[EntryDifference]) -> Iterator[str]:
    """Report which entries of a summary differ."""
    for one in found[:MOST_ENTRIES]:
        yield f"{one.file}: {one.entry}: {one.stored!r} stored, {one.now!r} now"
    if len(found) > MOST_ENTRIES:
        yield f"and {len(found) - MOST_ENTRIES} entries more"


def _parting(verdict: RunVerdict) -> Iterator[str]:
    """Report where the frames of a run differ from those of the new run."""
    frames = verdict.frames
    stored, now = frames.frames
    if stored != now:
        yield f"run.h5 has {stored} frames, the new run {now}"
    first = frames.first
    if first is None:
        yield "all frames that both have are identical" if stored != now else f"all {stored} frames are identical"
        return
    whose = "" if first.block is None else f"block {first.block}, "
    name, unit = _named(first.quantity)
    yield (
        f"first difference: frame {first.frame} of {stored} at {first.time:.6g} s, {whose}{name}: "
        f"{first.stored!r}{unit} stored, {first.now!r}{unit} now"
    )
    yield f"largest difference: {frames.largest_mm:.3g} mm, {frames.largest_deg:.3g}°"


def _named(quantity: str) -> tuple[str, str]:
    """Return a quantity without its unit, and the unit."""
    ends = (end for end in sorted(UNITS, key=len, reverse=True) if quantity.endswith(end))
    end = next(ends, "")
    return quantity.removesuffix(end), UNITS.get(end, "")


def _told_origins(origins: tuple[Origin, ...]) -> list[str]:
    """Report what has changed since the results were made."""
    if not origins:
        return ["code, versions and processor are unchanged"]
    return [f"changed since: {one.name}: {_change(one)}" for one in origins]


def _change(one: Origin) -> str:
    """Return a change in few words; of long lists only what was removed or added."""
    then, now = set(one.then.split()), set(one.now.split())
    if len(then | now) > MOST_WORDS:
        return " ".join([f"-{word}" for word in sorted(then - now)] + [f"+{word}" for word in sorted(now - then)])
    return f"{one.then[:LONGEST]} -> {one.now[:LONGEST]}"


def _of_sweep(verdict: SweepVerdict, what: str = "rows", study: str = "") -> VerificationReport:
    count = f"{len(verdict.checked)} of {verdict.rows} {what}"
    if verdict.agrees:
        kept = f", bit-identical in {len(verdict.runs)} kept runs" if verdict.runs else ""
        lines = [f"{verdict.folder}: {study}identical numbers in {count}{kept}"]
    else:
        rows = {one.row for one in verdict.cells}
        where = "" if study else f" in {len(rows)} of the {count} that were run again"
        lines = [f"{verdict.folder}: differs{where}"]
        lines += [INDENT + line for line in _cells(verdict)]
        lines += [INDENT + line for line in _entries(verdict.entries)]
        runs = [_of_run(run, told=False) for run in verdict.runs if not run.agrees]
        lines += [INDENT + line for run in runs for line in run.lines]
    return VerificationReport(tuple(lines), verdict.to_dict(), ExitCode(not verdict.agrees))


def _cells(verdict: SweepVerdict) -> Iterator[str]:
    """Report which cells of a sweep differ."""
    for one in verdict.cells[:MOST_CELLS]:
        values = f"{one.stored or 'nothing'} stored, {one.now or 'nothing'} now"
        yield f"row {one.row}, case {one.case}, {one.column}: {values}"
    if len(verdict.cells) > MOST_CELLS:
        yield f"and {len(verdict.cells) - MOST_CELLS} cells more"
    if verdict.cells:
        yield f"largest difference: {verdict.largest(MM):.3g} mm, {verdict.largest(DEGREES):.3g}°"
    yield from _told_origins(verdict.origins)
