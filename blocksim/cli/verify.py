"""blocksim verify: run the verification cases and print their table."""

from dataclasses import replace
from enum import StrEnum
from typing import Annotated

import typer

from blocksim.cli import completion, options
from blocksim.cli.output import grouped_lines, note, show
from blocksim.cli.prepare import tell_compilation
from blocksim.cli.progress import one_by_one
from blocksim.errors import ExitCode
from blocksim.scenario.models.stepping import IMPULSES, SPRINGS
from blocksim.simulation.compilation import kernel_set
from blocksim.verification.case import Row, Setting, Verdict
from blocksim.verification.cases import SettingError, chosen, chosen_of_soil, left_out, refuse_springs
from blocksim.verification.verify import (
    Outcome,
    error_text,
    expected_text,
    number,
    run_case,
    tolerance_text,
)

COLUMNS = ("quantity", "expected", "measured", "error", "tolerance", "verdict")


class Model(StrEnum):
    """How contacts are found."""

    SURFACE = "surface"
    PARTICLES = "particles"
    KERNEL = "kernel"


class Law(StrEnum):
    """How the force grows with the overlap."""

    LINEAR = "linear"
    HERTZ_MINDLIN = "hertz-mindlin"


class Scheme(StrEnum):
    """How time is stepped."""

    EXPLICIT = SPRINGS
    NONSMOOTH = IMPULSES


def verify_command(
    cases: Annotated[
        list[str] | None,
        typer.Argument(metavar="[CASE]...", help="V1 to V25 (default: all).", autocompletion=completion.cases),
    ] = None,
    model: Annotated[Model, typer.Option(help="Contact model.")] = Model.SURFACE,
    law: Annotated[Law, typer.Option(help="Force law.")] = Law.LINEAR,
    scheme: Annotated[Scheme, typer.Option(help="Stepping: springs or impulses.")] = Scheme.EXPLICIT,
    soil: Annotated[bool, typer.Option("--soil", help="The cases of soil, S1 to S11.")] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="Run reduced cases; the last lines list what was reduced.")
    ] = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Run the verification cases and show the table.

    Exit code 1: a number is out of tolerance. All cases take about four minutes on one core, half a minute with
    --scheme nonsmooth, which leaves out the cases about springs. --soil runs those of soil instead, nine minutes.

    Example: blocksim verify V3 V7 --law hertz-mindlin
    """
    silent = quiet or as_json
    setting = Setting(model.value, law.value, quick, scheme.value)
    refuse_springs(setting)
    if soil and (not setting.has_springs or setting != replace(Setting(), quick=quick)):
        raise SettingError("--soil has one setting: the surface model, linear springs, the explicit scheme")
    wanted = chosen_of_soil(cases or []) if soil else chosen(cases or [], setting.scheme)
    tell_compilation(kernel_set(setting.scheme, setting.model), quiet=silent)
    outcomes: list[Outcome] = []
    try:
        cases_told = one_by_one(wanted, lambda case: f"{case.id} {case.title}", quiet=silent)
        outcomes.extend(run_case(case, setting) for case in cases_told)
    finally:  # also when stopped: minutes of measuring must not be lost; the list has what was measured
        if outcomes:
            data = [row for outcome in outcomes for row in outcome.to_dicts()]
            groups = ((_heading(outcome), [_cells(row) for row in outcome.rows]) for outcome in outcomes)
            show(grouped_lines(COLUMNS, groups), data, as_json=as_json)
        if outcomes and not silent:
            _tell_end(outcomes)
    if not (silent or cases or soil):
        _tell_left_out(setting)
    inside = all(outcome.inside for outcome in outcomes)
    raise typer.Exit(ExitCode.SUCCESS if inside else ExitCode.OUTSIDE)


def _heading(outcome: Outcome) -> str:
    return f"{outcome.case.id} {outcome.case.title} ({outcome.case.source}): {outcome.seconds:.1f} s"


def _cells(row: Row) -> tuple[str, ...]:
    return (
        f"  {row.quantity}, {row.unit}" if row.unit else f"  {row.quantity}",
        expected_text(row),
        number(row.measured),
        error_text(row),
        tolerance_text(row),
        str(row.verdict),
    )


def _tell_end(outcomes: list[Outcome]) -> None:
    missed = [outcome for outcome in outcomes if not outcome.inside]
    for outcome in missed:
        count = sum(row.verdict == Verdict.OUTSIDE for row in outcome.rows)
        why = f": {outcome.remark}" if outcome.remark else ""
        note(f"{outcome.case.id} {outcome.case.title}: {count} of {len(outcome.rows)} outside{why}")
    for outcome in outcomes:
        if outcome.setting.quick and outcome.case.quick:
            note(f"{outcome.case.id} shortened: {outcome.case.quick}")
    seconds = sum(outcome.seconds for outcome in outcomes)
    note(f"{len(outcomes) - len(missed)} of {len(outcomes)} cases inside, {seconds:.0f} s")


def _tell_left_out(setting: Setting) -> None:
    found = left_out(setting.scheme)
    if found:
        note(f"left out: {'; '.join(found)}")
