"""blocksim sensitivity: inputs ranked by their effect on final positions."""

import csv
import io
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from blocksim.cli import completion, options
from blocksim.cli.output import note, number, show, table_lines
from blocksim.cli.prepare import tell_compilation
from blocksim.cli.progress import counting
from blocksim.errors import OutputExistsError
from blocksim.scenario import Document
from blocksim.simulation.atomic import write_text
from blocksim.simulation.compilation import kernels_of
from blocksim.study.sensitivity import INDICATOR, Indices, Sensitivity, sampled_plan, sensitivity
from blocksim.study.sensitivity_methods import METHODS
from blocksim.study.vary import SPREAD, read_variations

VARY = "--vary"
DIGITS = 3
SIGNS = {"deg": "°", INDICATOR: ""}
NOTHING = "nothing to vary: give --vary KEY=FROM:TO, or a [sweep] table with distributions"


class MethodName(StrEnum):
    """Methods by their names."""

    MORRIS = "morris"
    SOBOL = "sobol"


def sensitivity_command(
    scenario: options.ScenarioPath,
    vary: Annotated[
        list[str] | None,
        typer.Option(
            VARY,
            metavar="KEY=FROM:TO",
            help="An input and its distribution: KEY=FROM:TO, KEY=MEAN+-SD or KEY=a,b,c. Repeatable. "
            "Default: the distributions of [sweep].",
            autocompletion=completion.scenario_keys,
        ),
    ] = None,
    method: Annotated[MethodName, typer.Option(help="Elementary effects, or shares of the variance.")] = (
        MethodName.MORRIS
    ),
    samples: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            help="Morris: trajectories of k + 1 runs for k keys (default: 16); Sobol: base samples of k + 2 runs "
            "(default: 128).",
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="S", help="Random seed.")] = 0,
    settings: options.Settings = None,
    out: Annotated[Path | None, typer.Option("--out", metavar="CSV", help="Write all numbers to a table.")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace the table.")] = False,
    as_json: options.Json = False,
    quiet: options.Quiet = False,
) -> None:
    """Rank the inputs by their effect on final positions.

    The results are all measured quantities (without an experiment, x of the blocks) and the class of the outcome:
    rotations rounded to quarter turns. Blocks of the design with a failed run are left out and counted.
    Needs the extra blocksim[study].

    Example: blocksim sensitivity scenarios/slide.toml --vary gravity=9.7:9.9
    """
    silent = quiet or as_json
    _refuse_present(out, overwrite=overwrite)
    document = Document.read(scenario).with_settings(settings or [])
    plan = sampled_plan(document, read_variations(vary or [], VARY, SPREAD), VARY, NOTHING)
    bare = document.without_sweep()
    tell_compilation(kernels_of(bare.build()), quiet=silent)
    with counting("runs", quiet=silent) as on_member:
        found = sensitivity(bare, plan, METHODS[method.value], samples=samples, seed=seed, on_member=on_member)
    if out is not None:
        write_text(out, _csv(found))
    show(_lines(found), _data(found), as_json=as_json)
    if not silent:
        _tell_end(found, out)


def _refuse_present(out: Path | None, *, overwrite: bool) -> None:
    """Check before minutes of running that the table can be written."""
    if out is None:
        return
    if out.is_dir() or not out.absolute().parent.is_dir():
        reason = "it is a folder" if out.is_dir() else "no such folder"
        raise OutputExistsError(f"{out}: cannot be created: {reason}")
    if out.exists() and not overwrite:
        raise OutputExistsError(f"{out}: already exists; --overwrite replaces it")


def _lines(found: Sensitivity) -> list[str]:
    """Return a table for every output that varies."""
    lines: list[str] = []
    for output in found.outputs:
        if output.varies:
            lines += [*([""] if lines else []), _title(output), *_table(found, output)]
    return lines or ["no result varies: none of these inputs matters"]


def _title(output: Indices) -> str:
    if output.unit == INDICATOR:
        return f"{output.name}: in {output.mean:.0%} of the runs"
    return f"{output.name}: {number(output.mean)} {SIGNS.get(output.unit, output.unit)} ± {number(output.sd)} (s)"


def _table(found: Sensitivity, output: Indices) -> list[str]:
    """Return the keys of an output, the most important first."""
    columns = tuple(found.method.columns)
    first = output.numbers[columns[0]]
    order = sorted(range(len(found.keys)), key=lambda i: -abs(first[i]))
    rows = [[found.keys[i], *(number(output.numbers[column][i], DIGITS) for column in columns)] for i in order]
    return table_lines(("key", *(column.split(" ")[0] for column in columns)), rows)


def _tell_end(found: Sensitivity, out: Path | None) -> None:
    for column, meaning in found.method.columns.items():
        note(f"{column}: {meaning}")
    still = [output.name for output in found.outputs if not output.varies]
    if still:
        note(f"does not vary: {', '.join(still)}")
    if found.failed:
        note(
            f"{found.failed} of {found.runs} runs failed; {found.left_out} of {found.blocks} "
            f"{found.method.sample_word} are left out for it. The first: {found.first_problem}"
        )
    note(f"{found.runs} runs" + (f"; table: {out}" if out is not None else ""))


def _csv(found: Sensitivity) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, ["output", "unit", "key", *found.method.columns], lineterminator="\n")
    writer.writeheader()
    writer.writerows(found.records())
    return text.getvalue()


def _data(found: Sensitivity) -> dict[str, object]:
    return {
        "method": found.method.name,
        "meaning": dict(found.method.columns),
        "keys": list(found.keys),
        "runs": found.runs,
        "failed": found.failed,
        found.method.sample_word.replace(" ", "_"): found.blocks,
        "left_out": found.left_out,
        "outputs": [
            {"output": one.name, "unit": one.unit, "mean": one.mean, "sd": one.sd, "varies": one.varies}
            for one in found.outputs
        ],
        "indices": list(found.records()),
    }
