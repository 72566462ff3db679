"""blocksim verify and bench: run the cases, or the measurements of speed and memory, of a list; print their table."""

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated

from blocksim.bench import harness, registry
from blocksim.cli import command_line, output, prepare, progress
from blocksim.errors import ExitCode, OutputError
from blocksim.options import Option, Replace
from blocksim.scenario.laws import LAWS, LINEAR
from blocksim.scenario.models.timeline import IMPULSES, SPRINGS
from blocksim.simulation import files, schemes
from blocksim.verification import case, cases as case_list

COLUMNS = ("quantity", "expected", "measured", "error", "tolerance", "verdict")


def verify_command(
    *,
    cases: Annotated[
        list[str] | None,
        Option("V1 to V25 (default: all).", metavar="[CASE]...", complete="cases", is_argument=True),
    ] = None,
    model: Annotated[str, Option("Contact model.", choices=("surface", "particles", "kernel"))] = "surface",
    law: Annotated[str, Option("Force law.", choices=tuple(LAWS))] = LINEAR.name,
    scheme: Annotated[str, Option("Stepping: springs or impulses.", choices=(SPRINGS, IMPULSES))] = SPRINGS,
    soil: Annotated[bool, Option("The cases of soil, S1 to S12.")] = False,
    quick: Annotated[bool, Option("Run reduced cases; the last lines list what was reduced.")] = False,
    screen: command_line.Screen,
) -> command_line.Report:
    """Run the verification cases and show the table.

    Exit code 1: a number is out of tolerance. All cases take about four minutes on one core, half a minute with
    --scheme nonsmooth, which leaves out the cases about springs. --soil runs those of soil instead, nine minutes.

    Example: blocksim verify V3 V7 --law hertz-mindlin
    """
    setting = case.Setting(model, law, quick, scheme)
    wanted = case_list.choose_cases(cases or [], setting, soil=soil)
    prepare.announce_compilation(schemes.SCHEMES[setting.scheme].kernels(setting.model), quiet=screen.silent)
    outcomes: list[case.CaseOutcome] = []
    try:
        under_way = progress.one_by_one(wanted, lambda one: f"{one.id} {one.title}", quiet=screen.silent)
        outcomes.extend(case.run_case(one, setting) for one in under_way)
    except BaseException:  # minutes of measuring must not be lost; the list has what was measured
        if outcomes:
            screen.print(_report(outcomes))
        raise
    report = _report(outcomes)
    missing = () if cases or soil else case_list.exclusions(setting.scheme)
    return replace(report, notes=[*report.notes, f"left out: {'; '.join(missing)}"]) if missing else report


def _report(outcomes: list[case.CaseOutcome]) -> command_line.Report:
    groups = []
    for outcome in outcomes:
        one, texts = outcome.case, [row.texts for row in outcome.rows]
        heading = f"{one.id} {one.title} ({one.source}): {outcome.seconds:.1f} s"
        groups.append((heading, [(f"  {row['quantity']}", *(row[key] for key in COLUMNS[1:])) for row in texts]))
    return command_line.Report(
        output.grouped_lines(COLUMNS, groups),
        [row for outcome in outcomes for row in outcome.to_dicts()],
        list(_notes(outcomes)),
        code=ExitCode.SUCCESS if all(outcome.inside for outcome in outcomes) else ExitCode.OUTSIDE,
    )


def _notes(outcomes: list[case.CaseOutcome]) -> Iterator[str]:
    missed = [outcome for outcome in outcomes if not outcome.inside]
    for outcome in missed:
        count = sum(not row.is_inside for row in outcome.rows)
        why = f": {outcome.remark}" if outcome.remark else ""
        yield f"{outcome.case.id} {outcome.case.title}: {count} of {len(outcome.rows)} outside{why}"
    for outcome in outcomes:
        if outcome.setting.quick and outcome.case.quick:
            yield f"{outcome.case.id} shortened: {outcome.case.quick}"
    seconds = sum(outcome.seconds for outcome in outcomes)
    yield f"{len(outcomes) - len(missed)} of {len(outcomes)} cases inside, {seconds:.0f} s"


QUANTITIES = ("quantity", "unit", "median", "smallest", "largest")
LARGE = 100.0  # from here on a number has all digits before the point, and else three significant ones


def bench_command(
    *,
    names: Annotated[
        list[str] | None,
        Option(
            "three-blocks, ensemble, walls, threads, nonsmooth-blocks, nonsmooth-walls, nonsmooth-threads, "
            "soils, start-up.",
            metavar="[NAME]...",
            is_argument=True,
        ),
    ] = None,
    quick: Annotated[bool, Option("Run reduced cases; the last lines list what was reduced.")] = False,
    repeats: Annotated[int, Option("Samples of each number.", metavar="N", least=1)] = harness.REPEATS,
    out: Annotated[Path | None, Option("Write everything as JSON.", metavar="FILE")] = None,
    overwrite: Replace = False,
    screen: command_line.Screen,
) -> None:
    """Measure speed and memory, and show the table.

    Times of the solver are CPU seconds of its steps, medians over repeats with the smallest and largest sample. All
    measurements take some minutes on one core; nothing else should run.

    Example: blocksim bench walls --out bench.json
    """
    wanted = registry.choose(names or [])
    if out is not None:  # checked before minutes of measuring
        if out.is_dir() or not out.absolute().parent.is_dir():
            raise OutputError(f"{out}: cannot be written: {'it is a folder' if out.is_dir() else 'no such folder'}")
        files.refuse_foreign(out, overwrite=overwrite)
    machine = harness.this_machine()
    prepare.announce_compilation("surface", quiet=screen.silent)
    outcomes: list[harness.BenchmarkRun] = []
    try:
        under_way = progress.one_by_one(wanted, lambda one: f"{one.name}: {one.title}", quiet=screen.silent)
        outcomes.extend(one.run(harness.Effort(quick, repeats)) for one in under_way)
    finally:  # also when stopped: minutes of measuring must not be lost; the list has what was measured
        if outcomes:
            data = harness.report(machine, outcomes)
            if out is not None:
                files.write_text(out, json.dumps(data, indent=2) + "\n")
            written = [] if out is None else [f"written: {out}"]
            groups, notes = [], list[str]()
            for one in outcomes:
                name = one.measurement.name
                groups.append((f"{name}: {one.measurement.title}", [_row(found) for found in one.findings.numbers]))
                notes += [f"{name}: {text}" for text in one.findings.notes]
                notes += [f"{name} shortened: {one.shortened}"] if one.shortened else []
            seconds = sum(one.seconds for one in outcomes)
            notes += [*harness.machine_lines(machine), f"{seconds:.0f} s", *written]
            screen.print(command_line.Report(output.grouped_lines(QUANTITIES, groups, left=2), data, notes))


def _row(found: harness.Number) -> tuple[str, ...]:
    spread = (min(found.samples), max(found.samples)) if len(found.samples) > 1 else (math.nan, math.nan)
    texts = (
        f"{value:.0f}" if LARGE <= abs(value) < math.inf else case.number(value, 3) for value in (found.median, *spread)
    )
    return f"  {found.quantity}", found.unit, *texts
