"""blocksim verify: run the verification cases and print their table."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated

from blocksim.cli import command_line, output, prepare, progress
from blocksim.errors import ExitCode
from blocksim.options import Option
from blocksim.scenario.models.timeline import IMPULSES, SPRINGS
from blocksim.simulation.schemes import SCHEMES
from blocksim.verification.case import CaseOutcome, Setting, run_case
from blocksim.verification.cases import choose_cases, exclusions

COLUMNS = ("quantity", "expected", "measured", "error", "tolerance", "verdict")


def verify_command(
    *,
    cases: Annotated[
        list[str] | None,
        Option("V1 to V25 (default: all).", metavar="[CASE]...", complete="cases", is_argument=True),
    ] = None,
    model: Annotated[str, Option("Contact model.", choices=("surface", "particles", "kernel"))] = "surface",
    law: Annotated[str, Option("Force law.", choices=("linear", "hertz-mindlin"))] = "linear",
    scheme: Annotated[str, Option("Stepping: springs or impulses.", choices=(SPRINGS, IMPULSES))] = SPRINGS,
    soil: Annotated[bool, Option("The cases of soil, S1 to S11.")] = False,
    quick: Annotated[bool, Option("Run reduced cases; the last lines list what was reduced.")] = False,
    screen: command_line.Screen,
) -> command_line.Report:
    """Run the verification cases and show the table.

    Exit code 1: a number is out of tolerance. All cases take about four minutes on one core, half a minute with
    --scheme nonsmooth, which leaves out the cases about springs. --soil runs those of soil instead, nine minutes.

    Example: blocksim verify V3 V7 --law hertz-mindlin
    """
    setting = Setting(model, law, quick, scheme)
    wanted = choose_cases(cases or [], setting, soil=soil)
    prepare.announce_compilation(SCHEMES[setting.scheme].kernels(setting.model), quiet=screen.silent)
    outcomes: list[CaseOutcome] = []
    try:
        under_way = progress.one_by_one(wanted, lambda case: f"{case.id} {case.title}", quiet=screen.silent)
        outcomes.extend(run_case(case, setting) for case in under_way)
    except BaseException:  # minutes of measuring must not be lost; the list has what was measured
        if outcomes:
            screen.print(_report(outcomes))
        raise
    report = _report(outcomes)
    missing = () if cases or soil else exclusions(setting.scheme)
    return replace(report, notes=[*report.notes, f"left out: {'; '.join(missing)}"]) if missing else report


def _report(outcomes: list[CaseOutcome]) -> command_line.Report:
    groups = []
    for outcome in outcomes:
        case, texts = outcome.case, [row.texts for row in outcome.rows]
        heading = f"{case.id} {case.title} ({case.source}): {outcome.seconds:.1f} s"
        groups.append((heading, [(f"  {row['quantity']}", *(row[key] for key in COLUMNS[1:])) for row in texts]))
    return command_line.Report(
        output.grouped_lines(COLUMNS, groups),
        [row for outcome in outcomes for row in outcome.to_dicts()],
        list(_notes(outcomes)),
        code=ExitCode.SUCCESS if all(outcome.inside for outcome in outcomes) else ExitCode.OUTSIDE,
    )


def _notes(outcomes: list[CaseOutcome]) -> Iterator[str]:
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
