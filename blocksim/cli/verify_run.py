"""blocksim verify-run: check bitwise reproducibility of stored results."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from blocksim.cli import command_line, output, prepare, progress
from blocksim.errors import BlocksimError, ExitCode, InputMissingError, StoppedEarlyError
from blocksim.options import Option
from blocksim.scenario import Model
from blocksim.simulation import files, schemes
from blocksim.study import answer, manifest, run, run_folder, sweep, sweep_folder, verify

INDENT = "  "
MOST_LINES = 5
LONGEST = 60  # characters of an entry of the provenance
UNITS = {  # by the ends of names of quantities; the longer of two that fit first
    "_mm_s": " mm/s", "_deg_s": "°/s", "_mm": " mm", "_deg": "°", "_J": " J", "_s": " s", "_m": " m", "_N": " N"
}  # fmt: skip


def verify_run_command(
    *,
    places: Annotated[
        list[Path],
        Option(
            "Run folder, results/NAME (its newest finished run), scenario file, or folder of a sweep, limit or "
            "fragility study.",
            metavar="DIR",
            is_argument=True,
        ),
    ],
    threads: run.Threads = 1,
    sample: Annotated[
        int, Option("Number of rows of a sweep or study to run again.", metavar="N", least=1)
    ] = verify.SAMPLE,
    seed: Annotated[int, Option("Random seed for the choice of rows.", metavar="S", least=0)] = 0,
    screen: command_line.Screen,
) -> command_line.Report:
    """Run stored results again and check bitwise reproducibility.

    Of a run: checksums of all files, final state, every frame of run.h5, final.csv, and the steps, times, energies,
    movement and end in run.json. Of a sweep: the name of every case, and every cell of a sample of rows. Of limits and
    fragility studies: tables and answer, which are made again from the manifest, and a sample of runs. Exit code 1:
    something differs; the answer gives the first and the largest difference, and what has changed since: code,
    versions, processor. Nothing is written.

    Example: blocksim verify-run results/three_blocks
    """
    reports = [_verified(place, threads, sample, seed, screen) for place in places]
    lines = [line for one in reports for line in one.lines]
    # of several codes the most severe: 65, 66 before 1 before 0
    return command_line.Report(lines, [one.data for one in reports], code=max(one.code for one in reports))


def _verified(place: Path, threads: int, sample: int, seed: int, screen: command_line.Screen) -> command_line.Report:
    """Verify one place; an error in it does not stop the others."""
    try:
        study = answer.study_in(place)
        if study is not None:
            kernels = [schemes.kernels_of(Model.stored(place / study.answer.files.plan).scenario)]
        else:
            kernels = (
                [*sweep.kernels_for(sweep_folder.read_plan(place))]
                if manifest.is_sweep(place)
                else [schemes.kernels_of(Model.stored(run_folder.find_run(place) / files.SCENARIO).scenario)]
            )
        for one in kernels:
            prepare.announce_compilation(one, quiet=screen.silent)
        if study is not None:
            return _of_study(verify.verify_study(place, study, sample, seed))
        if manifest.is_sweep(place):
            return _of_sweep(verify.verify_sweep(place, sample, seed))
        with progress.run_progress(quiet=screen.silent) as on_progress:
            verdict = verify.verify_run(place, threads=threads, on_progress=on_progress)
        if verdict.agrees and verdict.origins:
            screen.note("\n".join(_changes(verdict.origins)))
        return _of_run(verdict)
    except StoppedEarlyError:
        raise
    except BlocksimError as error:
        output.note(str(error))
        kind = "missing" if isinstance(error, InputMissingError) else "damaged"
        data = {"agrees": False, "kind": kind, "folder": str(place), "error": str(error)}
        return command_line.Report([f"{place}: {kind}"], data, code=error.exit_code)


def _of_study(verdicts: tuple[verify.SweepVerdict, ...]) -> command_line.Report:
    """Report a study, of a curve of limits every search and then the curve."""
    reports = [_of_sweep(one, "runs", "table and answer follow from the runs; ") for one in verdicts]
    agrees = all(one.agrees for one in verdicts)
    data = {**verdicts[-1].to_dict(), "agrees": agrees, "kind": "study"}
    if len(verdicts) > 1:
        data["searches"] = [one.data for one in reports[:-1]]
        if verdicts[-1].agrees:
            follows = f"{verdicts[-1].folder}: table and answer follow from the searches"
            reports[-1] = replace(reports[-1], lines=[follows])
    return command_line.Report([line for one in reports for line in one.lines], data, code=ExitCode(not agrees))


def _of_run(verdict: verify.RunVerdict) -> command_line.Report:
    lines = [f"{verdict.folder}: bit-identical: final state, {verdict.frames.frames[0]} frames, final.csv"]
    if not verdict.agrees:
        lines = [f"{verdict.folder}: differs", *(INDENT + line for line in _reasons(verdict))]
    return command_line.Report(lines, verdict.to_dict(), code=ExitCode(not verdict.agrees))


def _of_sweep(verdict: verify.SweepVerdict, what: str = "rows", study: str = "") -> command_line.Report:
    count = f"{len(verdict.checked)} of {verdict.rows} {what}"
    if verdict.agrees:
        kept = f", bit-identical in {len(verdict.runs)} kept runs" if verdict.runs else ""
        lines = [f"{verdict.folder}: {study}identical numbers in {count}{kept}"]
    else:
        rows = {one.row for one in verdict.cells}
        where = "" if study else f" in {len(rows)} of the {count} that were run again"
        runs = (line for one in verdict.runs if not one.agrees for line in _of_run(one).lines)
        reasons = (*_cells(verdict), *_entries(verdict.entries), *runs)
        lines = [f"{verdict.folder}: differs{where}", *(INDENT + line for line in reasons)]
    return command_line.Report(lines, verdict.to_dict(), code=ExitCode(not verdict.agrees))


def _reasons(verdict: verify.RunVerdict) -> Iterator[str]:
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
    yield from _changes(verdict.origins)


def _entries(found: Sequence[verify.EntryDifference]) -> Iterator[str]:
    """Report which entries of a summary differ."""
    yield from first_of(
        [f"{one.file}: {one.entry}: {one.stored!r} stored, {one.now!r} now" for one in found], "entries"
    )


def first_of(lines: Sequence[str], what: str) -> Iterator[str]:
    """Yield the first of many lines, and how many there are more."""
    yield from lines[:MOST_LINES]
    if len(lines) > MOST_LINES:
        yield f"and {len(lines) - MOST_LINES} {what} more"


def _parting(verdict: verify.RunVerdict) -> Iterator[str]:
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
    end = next((end for end in UNITS if first.quantity.endswith(end)), "")
    name, unit = first.quantity.removesuffix(end), UNITS.get(end, "")
    yield (
        f"first difference: frame {first.frame} of {stored} at {first.time:.6g} s, {whose}{name}: "
        f"{first.stored!r}{unit} stored, {first.now!r}{unit} now"
    )
    yield f"largest difference: {frames.largest_mm:.3g} mm, {frames.largest_deg:.3g}°"


def _cells(verdict: verify.SweepVerdict) -> Iterator[str]:
    """Report which cells of a sweep differ."""
    values = (f"{one.stored or 'nothing'} stored, {one.now or 'nothing'} now" for one in verdict.cells)
    places = (f"row {one.row}, case {one.case}, {one.column}" for one in verdict.cells)
    yield from first_of(list(map(": ".join, zip(places, values, strict=True))), "cells")
    if verdict.cells:
        yield f"largest difference: {verdict.largest(verify.MM):.3g} mm, {verdict.largest(verify.DEGREES):.3g}°"
    yield from _changes(verdict.origins)


def _changes(origins: tuple[verify.OriginDifference, ...]) -> Iterator[str]:
    """Yield what has changed since the results were made; of long lists only what was removed or added."""
    if not origins:
        yield "code, versions and processor are unchanged"
    for one in origins:
        then, now = set(one.then.split()), set(one.now.split())
        change = f"{one.then[:LONGEST]} -> {one.now[:LONGEST]}"
        if len(then | now) > 12:
            words = [f"-{word}" for word in sorted(then - now)] + [f"+{word}" for word in sorted(now - then)]
            change = " ".join(words)
        yield f"changed since: {one.name}: {change}"
