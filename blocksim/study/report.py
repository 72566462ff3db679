"""Runs and sweeps brought into the form of a report, as `blocksim report` and `blocksim.report` ask for it."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from blocksim.analysis.compare import Comparison
from blocksim.analysis.metrics import Judgement
from blocksim.errors import BlocksimError, InputMissingError, InvalidInputError, UnavailableError
from blocksim.scenario import Model, input_files, scenario_to_toml
from blocksim.simulation import Result, files
from blocksim.study import answer, compare, manifest, pictures, rows, run_folder, sweep_folder
from blocksim.view.report import page, player, subjects as parts

MEMBERS = 50  # of a sweep in one page
MOST_TABLE_BYTES = 200 * input_files.MEGABYTE  # of sweep.csv


def report(
    *places: run_folder.Place,
    out: Path | str = "report.html",
    experiment: Path | str | None = None,
    overwrite: bool = False,
) -> Path:
    """Write runs and sweeps into one self-contained HTML file with a player, and return its path.

    Raises as `plot` does, and InvalidInputError, after writing, for what is damaged in them.

    >>> kept = run(load("scenarios/slide.toml", {"contact.stiffness_scale": 0.001}), out="results/kept")
    >>> report(kept, out="slide.html").name
    'slide.html'
    """
    path = Path(out)
    files.refuse_foreign(path, overwrite=overwrite)
    table = None if experiment is None else Path(experiment)
    _, problems = report_on([run_folder.folder_of(place) for place in places], path, table)
    if problems:
        raise InvalidInputError("\n".join(problems))
    return path


def report_on(
    places: Sequence[Path],
    out: Path,
    experiment: Path | None = None,
    members: int = MEMBERS,
    on_remark: Callable[[str], None] = lambda _: None,
) -> tuple[int, list[str]]:
    """Write runs, sweeps and studies into one HTML file; return its size in bytes and what is damaged in them.

    `members` is the maximum number of runs of a sweep in the page; `on_remark` hears which of several runs is taken.
    Raises what finding and reading them raises, and OutputError.
    """
    shown, problems = subjects_of(places, experiment, members, on_remark)
    return page.write_report(shown, out), problems


def page_of_result(result: Result, experiment: Path | None = None) -> str:
    """Return the text of the page of a run in memory. Raises as `report` does."""
    text = scenario_to_toml(result.scenario)
    run = parts.PartialRun(
        Path(result.name), result.model, text, result.summary, result.frames, result.columns, probes=result.probes
    )
    return page.page_text([parts.run_subject("part-1", run, *_compared(run, experiment))])


def subjects_of(
    places: Sequence[Path],
    experiment: Path | None = None,
    members: int = MEMBERS,
    on_remark: Callable[[str], None] = lambda _: None,
) -> tuple[list[parts.Subject], list[str]]:
    """Return runs, sweeps and studies as parts of a page, see `report_on`, and what is damaged in them."""
    shown: list[parts.Subject] = []
    problems: list[str] = []
    for place in places:
        key = f"part-{len(shown) + 1}"
        study = answer.study_in(place)
        if study is not None:
            found = study.answer.read(place)
            page = answer.page_of(found, Model.stored(place / found.files.plan).scenario)
            shown.append(parts.study_subject(key, page, str(place)))
            continue
        if manifest.is_sweep(place):
            subjects, damage = _sweep(key, place, experiment, members)
        else:
            is_run = place.is_dir() and any((place / name).is_file() for name in files.OURS)  # even if files lack
            folder = place if is_run else run_folder.find_run(place)
            run = parts.read_folder(folder)
            subjects, damage = [parts.run_subject(key, run, *_compared(run, experiment))], run.damage
            remark = run_folder.choice(place, folder)
            if remark:
                on_remark(remark)
        shown += subjects
        problems += damage
    return shown, problems


def _compared(run: parts.PartialRun, experiment: Path | None) -> tuple[dict[str, object] | None, tuple[str, ...]]:
    """Return the comparison of a finished run, or why there is none though there is a measurement."""
    named = None if run.model is None else run.model.scenario.experiment
    table = experiment or (named.table if named else None)
    if table is None or run.final is None:
        return None, ()
    if run.status != rows.FINISHED:
        return None, ("only a finished run is compared with the measurement",)
    try:
        return _shown(compare.against(table, run.final, run.probes)), ()
    except BlocksimError as error:
        if experiment is not None:
            raise
        return None, (str(error),)


def _shown(found: Comparison | Judgement) -> dict[str, Any]:
    """Return a comparison as a report has it, without paths of the machine."""
    messages = [parts.local_text(text) for text in found.messages]
    return {**found.to_dict(), "experiment": parts.local_path(found.source), "messages": messages}


def _sweep(key: str, place: Path, experiment: Path | None, most: int) -> tuple[list[parts.Subject], tuple[str, ...]]:
    """Return a sweep and those of its members that have frames as subjects, and what is damaged in them.

    Rows that are cut off are left out. Raises InvalidInputError for what is no table of a sweep.
    """
    path = place / rows.TABLE
    columns, *lines = list(filter(None, manifest.lines_in(path, MOST_TABLE_BYTES))) or [[]]
    if not set(columns) >= manifest.NEEDED:
        raise InvalidInputError(f"{path}: {manifest.NO_TABLE}: {manifest.NO_COLUMNS}")
    table = parts.CaseTable(place, tuple(columns), tuple(tuple(row) for row in lines if len(row) == len(columns)))
    planned = manifest.planned_in(place) or len(table.rows)
    problems: list[str] = []
    scenario, judged, drawings = None, None, []
    try:
        scenario = Model.stored(place / sweep_folder.PLAN).scenario
    except InputMissingError:
        pass
    except BlocksimError as error:
        problems.append(str(error))
    try:
        if experiment is not None or (scenario is not None and scenario.experiment is not None):
            judged = _shown(compare.compare_sweep(place, experiment))
    except BlocksimError as error:
        if experiment is not None and not isinstance(error, UnavailableError):
            raise
        problems.append(str(error))
    try:
        sweep = pictures.read_sweep_data(place, experiment)
    except BlocksimError as error:
        problems.append(f"no picture of the sweep: {error}")
    else:
        is_whole = len(sweep.finished) == len(table.rows)
        drawings = parts.pictures_of(sweep) if is_whole else []
        problems += [] if is_whole else ["no picture of the sweep: its table is damaged"]
    folders = {case: sweep_folder.case_folder(table.folder, case) for case in table.column("case")}
    cases = {case: one for case, one in folders.items() if one is not None and (one / files.FRAMES).is_file()}
    found = [(case, parts.read_folder(folder)) for case, folder in list(cases.items())[:most]]
    keys = {case: f"{key}-member-{number}" for number, (case, _) in enumerate(found, start=1)}
    subject = parts.sweep_subject(
        key, table, scenario, keys, problems, list(cases)[most:], planned=planned, judged=judged, pictures=drawings
    )
    shown = [
        parts.run_subject(
            keys[case], run, *_compared(run, experiment), most_bytes=player.MOST_BYTES // len(found), parent=key
        )
        for case, run in found
    ]
    return [subject, *shown], tuple(text for _, run in found for text in run.damage)
