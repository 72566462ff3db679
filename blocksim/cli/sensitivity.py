"""blocksim sensitivity: inputs ranked by their effect on final positions."""

import csv
import io
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

from blocksim.cli import command_line, output, prepare, progress
from blocksim.errors import OutputExistsError
from blocksim.options import Option
from blocksim.scenario import Model
from blocksim.simulation.files import write_text
from blocksim.study.sensitivity import INDICATOR, Indices, Sensitivity, SensitivityOptions, sensitivity

DIGITS = 3
SIGNS = {"deg": "°", INDICATOR: ""}


def sensitivity_command(
    source: prepare.ScenarioInput,
    options: SensitivityOptions,
    *,
    out: Annotated[Path | None, Option("Write all numbers to a table.", metavar="CSV")] = None,
    overwrite: Annotated[bool, Option("Replace the table.")] = False,
    screen: command_line.Screen,
) -> command_line.Report:
    """Rank the inputs by their effect on final positions.

    The results are all measured quantities (without an experiment, x of the blocks) and the class of the outcome:
    rotations rounded to quarter turns. Trajectories or base samples with a failed run are left out and counted.
    Needs the extra blocksim[study].

    Example: blocksim sensitivity scenarios/slide.toml --vary gravity=9.7:9.9
    """
    if out is not None:  # before minutes of running
        if out.is_dir() or not out.absolute().parent.is_dir():
            reason = "it is a folder" if out.is_dir() else "no such folder"
            raise OutputExistsError(f"{out}: cannot be created: {reason}")
        if out.exists() and not overwrite:
            raise OutputExistsError(f"{out}: already exists; --overwrite replaces it")
    document = source.document()
    prepare.warn_of_values([Model(document.without_sweep())], screen)
    start = partial(prepare.announce_compilation, quiet=screen.silent)
    with progress.count_progress("runs", quiet=screen.silent) as on_member:
        found = sensitivity(document, replace(options, on_start=start, on_member=on_member))
    if out is not None:
        text = io.StringIO()
        writer = csv.DictWriter(text, ["output", "unit", "key", *found.method.columns], lineterminator="\n")
        writer.writeheader()
        writer.writerows(found.records())
        write_text(out, text.getvalue())
    lines: list[str] = []
    for one in found.outputs:
        if one.numbers:
            lines += [*([""] if lines else []), *_table(found, one)]
    return command_line.Report(
        lines or ["no result varies: none of these inputs matters"], found.to_dict(), _notes(found, out)
    )


def _table(found: Sensitivity, one: Indices) -> list[str]:
    """Return the keys of an output that varies, the most important first."""
    sign = SIGNS.get(one.unit, one.unit)
    what = f"{output.number(one.mean)} {sign} ± {output.number(one.sd)} (s)"
    title = f"{one.name}: {f'in {one.mean:.0%} of the runs' if one.unit == INDICATOR else what}"
    columns = tuple(found.method.columns)
    first = one.numbers[columns[0]]
    order = sorted(range(len(found.keys)), key=lambda i: -abs(first[i]))
    rows = [[found.keys[i], *(output.number(one.numbers[column][i], DIGITS) for column in columns)] for i in order]
    return [title, *output.table_lines(("key", *(column.split(" ")[0] for column in columns)), rows)]


def _notes(found: Sensitivity, out: Path | None) -> Iterator[str]:
    yield from found.remarks
    yield f"{found.runs} runs" + (f"; table: {out}" if out is not None else "")
