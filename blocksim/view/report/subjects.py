"""The parts of a report: runs, sweeps and studies, as far as their folders can be read.

Pictures are those of `view` as SVG, with the places of their panels for cursor and pointer.
"""

import math
import re
from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

import numpy as np

from blocksim.errors import BlocksimError, InputMissingError, InvalidInputError
from blocksim.scenario import Model, Scenario, document, input_files
from blocksim.simulation import files, instruments, observables, results as result, trajectory
from blocksim.simulation.stores.hdf5 import read_frames, read_probes
from blocksim.view import history, kinds, run_data, scene, style, time_panels
from blocksim.view.report.player import MOST_BYTES, pack_forces, pack_frames, pack_loads, scene_data
from blocksim.view.sweeps import outcome_map
from blocksim.view.sweeps.data import SweepData, short_names

ROOT = r"(?:/|[A-Za-z]:[\\/])"
ABSOLUTE = re.compile(rf"'(?P<quoted>{ROOT}[^']+)'|(?<![^\s=,(\"])(?P<bare>{ROOT}[^\s'\",:;()]+)")


def local_path(path: str) -> str:
    """Return an absolute path as seen from the current folder, or its last name where it lies elsewhere."""
    below = input_files.relative_path(path)
    is_elsewhere = below == path and re.match(ROOT, path) is not None
    return re.split(r"[\\/]", path.rstrip("\\/"))[-1] if is_elsewhere else below


def local_text(text: str) -> str:
    """Return a text with all absolute paths in it as `local_path` has them; those with spaces need quotes."""
    return ABSOLUTE.sub(lambda found: f"'{local_path(q)}'" if (q := found["quoted"]) else local_path(found[0]), text)


Part = TypeVar("Part")

LEDGER = {  # name in run.json: name in the report
    "kinetic": "kinetic",
    "potential": "potential",
    "stored_normal": "stored, normal",
    "stored_shear": "stored, shear",
    "dashpot": "lost in dashpots",
    "friction": "lost in friction",
    "broken": "lost as contacts broke",
    "impacts": "lost in impacts",
    "correction": "correction of positions",
    "to_support": "given to the support",
    "to_loads": "given to loads",
    "events": "taken by events",
    "start": "at the start",
    "in_play": "in play",
    "residual": "residual",
}

ALWAYS = ("kinetic", "potential", "residual")
ROUND_OFF = 1e-12  # of the energy in play
RATIOS = ("relative_residual",)  # in run.json beside energies

DRAWN = ("x", "y", "rotation")  # measured quantities that have a curve
NO_SUMMARY = "no summary: the run was killed, is still running, or its run.json cannot be read"
NO_FORCES = "This run has stored no contacts, so their forces cannot be shown; --set output.contacts=true stores them."


@dataclass(frozen=True)
class PartialRun:
    """The parts of a run that could be read, None for the others.

    `problems` give the reasons, a line each; `damage` are those that are not missing files.
    """

    folder: Path
    model: Model | None
    scenario_text: str | None
    summary: result.Summary | None
    frames: trajectory.Frames | None
    final: trajectory.Columns | None
    problems: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    probes: Mapping[str, instruments.ProbeSeries] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The scenario's name; that of the folder where it is not known."""
        if self.model is not None:
            return self.model.scenario.name
        return self.folder.name if self.summary is None else self.summary.name

    @property
    def status(self) -> str:
        """`finished`, `failed` or `interrupted`; `unfinished` where the run left no summary."""
        return "unfinished" if self.summary is None else self.summary.status


def read_folder(folder: Path) -> PartialRun:
    """Return what a run's folder holds. Raises InvalidInputError where nothing of it can be read."""
    problems: list[str] = []
    damage: list[str] = []

    def attempt(read: Callable[[], Part]) -> Part | None:
        """Return what `read` returns, None where it raises an error of the input."""
        try:
            return read()
        except BlocksimError as error:
            problems.append(str(error))
            if not isinstance(error, InputMissingError):
                damage.append(str(error))
            return None

    model = attempt(lambda: Model.stored(folder / files.SCENARIO))
    summary = attempt(lambda: result.read_summary(folder / files.SUMMARY))
    frames = None if model is None else attempt(lambda: read_frames(folder / files.FRAMES, model))
    final = attempt(lambda: trajectory.read_table(folder / files.FINAL))
    if model is None and summary is None and final is None:
        raise InvalidInputError("\n".join([f"{folder}: nothing of this run can be read", *problems]))
    probes = None
    if model is not None and frames is not None:
        probes = attempt(lambda: read_probes(folder / files.FRAMES, model))
    text = None
    with suppress(BlocksimError):
        text = input_files.read_limited(folder / files.SCENARIO, document.MAX_BYTES).decode(errors="replace")
    return PartialRun(folder, model, text, summary, frames, final, tuple(problems), tuple(damage), probes or {})


COORDINATES = re.compile(r'(?<= (?:d|x|y)=")[^"]*')
DIGITS = re.compile(r"(\.\d\d)\d+")


def svg_address(figure: "style.Figure") -> str:
    """Return a figure as the address of an SVG within the page: letters as text, coordinates to 0.01 points."""
    from matplotlib import rc_context

    with rc_context({"svg.fonttype": "none"}):
        svg = style.figure_bytes(figure, ".svg").decode()
    short = COORDINATES.sub(lambda found: DIGITS.sub(r"\1", found[0]).replace("\n", ""), svg)
    return f"data:image/svg+xml;base64,{b64encode(short.encode()).decode()}"


def history_of(
    frames: trajectory.Frames, support: run_data.Support, measured: run_data.Repeats | None
) -> tuple[str, list[dict[str, Any]]]:
    """Return the histories of a run, and of each panel its name, place and the ends of its axes."""
    with history.draw_history_page(frames, scene.PictureOptions(None, measured, support)) as (figure, panels):
        places = [
            {"name": name, "place": _place(axes), "time": axes.get_xlim(), "values": axes.get_ylim()}
            for name, axes in panels.items()
        ]
        return svg_address(figure), places


def pictures_of(sweep: SweepData) -> list[dict[str, Any]]:
    """Return the pictures of a sweep: maps over every two inputs, and all other kinds that suit it.

    A map has where its panels lie, row by row, and for every case the column that it is in and its place there.
    """
    pairs = (
        []
        if kinds.SWEEP_KINDS["map"].refusal(sweep)
        else combinations([one for one in sweep.inputs if not one.levels], 2)
    )
    names = dict(zip((one.key for one in sweep.inputs), short_names([one.key for one in sweep.inputs]), strict=True))
    maps = []
    for x, y in [*pairs][:6]:  # of a sweep, each over two of its inputs
        found = outcome_map.map_of(sweep, (x, y))
        with outcome_map.draw_map(sweep, style.OWN, found, by_manner=any(sweep.manners)) as figure:
            label = f"map of {names[y.key]} over {names[x.key]}"
            maps.append({"label": label, "source": svg_address(figure), "data": _cases(found)})
    others = []
    for name, kind in kinds.SWEEP_KINDS.items():
        if name != "map" and kind.suits(sweep):
            with kind.open(sweep, style.OWN) as figure:
                others.append({"label": name, "source": svg_address(figure), "data": None})
    return maps + others


def _cases(found: outcome_map.OutcomeMap) -> dict[str, Any]:
    count = len(found.sweep.finished)
    column, places = np.full(count, -1), np.zeros((count, 2))
    for number, (axes, (_, cases)) in enumerate(zip(found.panels[0], found.columns, strict=True)):
        plane = found.plane(cases)
        points = axes.transData.transform(np.stack([plane.x, plane.y], axis=-1))
        column[cases], places[cases] = number, axes.transAxes.inverted().transform(points)
    x, y = places.round(4).T.tolist()
    return {
        "panels": [[_place(axes) for axes in row] for row in found.panels],
        "column": column.tolist(),
        "x": x,
        "y": y,
    }


def _place(axes: "style.Axes") -> list[float]:
    """Return left, top, width and height of a panel as shares of the page, y down."""
    box = axes.get_position()
    return [round(float(share), 5) for share in (box.x0, 1.0 - box.y1, box.width, box.height)]


@dataclass(frozen=True)
class Subject:
    """One part of a report: `page` is for the template, `data` for the scripts; `key` ties the two together."""

    key: str
    kind: str
    name: str
    page: Mapping[str, Any]
    data: Mapping[str, Any] = field(repr=False)


def run_subject(
    key: str,
    run: PartialRun,
    comparison: Mapping[str, Any] | None = None,
    remarks: tuple[str, ...] = (),
    *,
    most_bytes: int = MOST_BYTES,
    parent: str | None = None,
) -> Subject:
    """Return a run for a report; `comparison` is what `Comparison.to_dict` gives, `remarks` are further problems.

    `parent` is the key of the sweep that it is a member of.
    """
    data, notes, problems, address = _player_data(run, comparison, most_bytes)
    probes = [
        {
            "text": f"{name}: {one.kind}, {len(one)} samples to {one.time[-1]:.4g} s, in probe-{name}.csv",
            "picture": b64encode(time_panels.probe_picture(one)).decode(),
        }
        for name, one in (() if parent is not None else run.probes.items())
        if len(one)
    ]
    page = {
        "parent": parent,
        "place": local_path(str(run.folder)),
        "status": run.status,
        "reason": NO_SUMMARY if run.summary is None else local_text(run.summary.reason),
        "summary": _summary(run),
        "problems": [local_text(text) for text in (*run.problems, *problems, *remarks)],
        "scenario": run.scenario_text,
        "values": None if run.model is None else run.model.scenario.model_dump(by_alias=True, exclude={"sweep"}),
        "description": None if run.model is None else run.model.scenario.description,
        "notes": notes,
        "final": [] if run.final is None else trajectory.rows_of(run.final),
        "joints": _joints(run),
        "comparison": comparison,
        "ledger": _ledger(run),
        "provenance": _provenance(run),
        "probes": probes,
        "has_player": data is not None,
        "history": address,
        "names": data["names"] if data else [],
        "has_particles": bool(data and data["scene"]["particles"]),
        "has_forces": bool(data and data["forces"]),
        "has_loads": bool(data and data["loads"]),
        "has_shades": bool(data and any(system["shades"] for system in data["systems"])),
        "has_measured": bool(data and data["measured"]),
    }
    return Subject(key, "run", run.name, page, {"kind": "run", "name": run.name, "frames": data})


def _player_data(
    run: PartialRun, comparison: Mapping[str, Any] | None, most_bytes: int
) -> tuple[dict[str, Any] | None, list[str], list[str], str | None]:
    """Return frames and scene for the player, notes on them, problems with them, and the histories as a picture."""
    frames, model = run.frames, run.model
    if frames is None or model is None:
        return None, [], [], None
    try:
        data, kept, notes = pack_frames(frames, most_bytes)
    except InvalidInputError as error:
        return None, [], [str(error)], None
    happened = () if run.summary is None else run.summary.events
    drawn = scene_data(frames, model, kept, happened)
    forces, found = pack_forces(frames, kept, drawn["tilt"]), pack_loads(frames, model, kept, happened, run.probes)
    notes, loads = [*notes, NO_FORCES if forces is None else forces["told"]], None
    if found is not None:
        loads, extent, more = found
        drawn["extent"], notes = [extent.left, extent.right, extent.bottom, extent.top], notes + more
    rows = [] if comparison is None else comparison["rows"]
    numbers = {name: number for number, name in enumerate(data["names"])}
    measured = [  # mean and range of the repeats (mm or degrees) by the number of the block
        {"block": numbers[row["block"]], **{key: row[key] for key in ("quantity", "minimum", "mean", "maximum")}}
        for row in rows
        if row["block"] in numbers and row["quantity"] in DRAWN and row["mean"] is not None
    ]
    data |= {"scene": drawn, "forces": forces, "loads": loads, "measured": measured}
    address = None
    if data["names"]:
        repeats = [SimpleNamespace(**row) for row in rows if row["mean"] is not None]
        support = run_data.support_of(model, happened)
        address, data["histories"] = history_of(frames, support, repeats if comparison else None)
    return data, notes, [], address


def _summary(run: PartialRun) -> list[tuple[str, str]]:
    """Return names and values for people."""
    tracks = () if run.frames is None else run.frames.tracks
    blocks = [(track.system.name, str(len(track.names))) for track in tracks]
    if run.summary is None:
        last = [] if run.frames is None else [("recorded until", f"{run.frames.time[-1]:.4g} s")]
        return [*blocks, *last]
    summary, error = run.summary, run.summary.energy_J.relative_residual
    return [
        *blocks,
        *(() if summary.movement is None else summary.movement.lines("{:.2f}".format)),
        ("simulated time", f"{summary.simulated_time_s:.4g} s"),
        ("steps", f"{summary.steps} of {summary.time_step_s:.3g} s"),
        ("solver time", f"{summary.solver_seconds:.2f} s on {summary.threads} thread{'s' * (summary.threads > 1)}"),
        ("relative energy error", "0" if error == 0.0 else f"{error:.1e}" if math.isfinite(error) else "unknown"),
        *(("warning", local_text(warning)) for warning in summary.warnings),
    ]


def _joints(run: PartialRun) -> list[dict[str, Any]]:
    """Return the joints across structures with their states, and with why there are no active factors."""
    states = {} if run.summary is None else run.summary.joints
    return [
        {"state": state, **row.model_dump(), "why": one.reasons.get(row.structure, "")}
        for state, one in states.items()
        for row in one.joints
    ]


def _ledger(run: PartialRun) -> list[tuple[str, str]]:
    if run.summary is None:
        return []
    values = run.summary.energy_J.model_dump()
    # entries that a scheme does not have are zero
    names = [*(name for name in values if name not in (*LEDGER, *RATIOS)), *LEDGER]  # of other systems first
    least = ROUND_OFF * abs(values["in_play"])
    shown = [name for name in names if name in ALWAYS or not abs(values[name]) <= least]
    texts = {name: f"{values[name]:.6g}".replace("-", "−") if math.isfinite(values[name]) else "–" for name in shown}
    return [(LEDGER.get(name, name.replace("_", " ")), text) for name, text in texts.items()]


def _provenance(run: PartialRun) -> list[tuple[str, str]]:
    if run.summary is None:
        return []
    summary = run.summary
    hashes = [("run", summary.run), ("scenario", summary.scenario_hash), ("final state", summary.final_state_sha256)]
    environment = [(name, local_text(text)) for name, text in summary.environment.items()]  # the command names folders
    return [("ended at", summary.ended_at), *hashes, *environment, *summary.sha256.items()]


CASE, STATUS = "case", "status"  # what is varied stands between them
OF_BLOCKS = (".x_mm", ".y_mm", ".rotation_deg", ".left_mm", ".right_mm")
MOST_VALUES = 400_000  # of blocks in the page; a sweep of 10 000 cases shows 13 blocks


@dataclass(frozen=True)
class CaseTable:
    """The rows of sweep.csv as texts, by column."""

    folder: Path
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]

    @property
    def keys(self) -> tuple[str, ...]:
        """Columns of the keys that vary, as `SweepResult.keys` has them."""
        return self.columns[self.columns.index(CASE) + 1 : self.columns.index(STATUS)]

    @property
    def results(self) -> tuple[str, ...]:
        """Columns of what is known of a whole case: status, movement and whatever else is not of a block."""
        known = {CASE, *self.keys}
        return tuple(name for name in self.columns if name not in known and not name.endswith(OF_BLOCKS))

    def column(self, name: str) -> list[str]:
        """Return one column; empty texts where there is none."""
        if name not in self.columns:
            return [""] * len(self.rows)
        place = self.columns.index(name)
        return [row[place] for row in self.rows]


COLUMN_OF = {"x": "x_mm", "rotation": "rotation_deg"}
"""Measured quantities whose final values are in the page."""


def sweep_subject(
    key: str,
    table: CaseTable,
    scenario: Scenario | None,
    members: Mapping[str, str],
    problems: Sequence[str] = (),
    left_out: Sequence[str] = (),
    *,
    planned: int = 0,
    judged: Mapping[str, Any] | None = None,
    pictures: Sequence[Mapping[str, Any]] = (),
) -> Subject:
    """Return a sweep for a report; `members` are the keys of the subjects of its cases.

    `left_out` are cases with frames that are not in the page, `planned` how many cases there are to be. `judged` is
    what `Judgement.to_dict` gives, `pictures` what `pictures_of` does.
    """
    name = table.folder.name if scenario is None else scenario.name
    inside = [value for value in table.column("inside") if value]
    blocks = tuple(name.removesuffix(".x_mm") for name in table.columns if name.endswith(".x_mm"))
    shown = blocks[: max(1, MOST_VALUES // (2 * max(1, len(table.rows))))]
    rows = [] if judged is None else judged["metrics"]["inside"]["rows"]
    limits = {  # of inside, by the column of the table
        f"{row['block']}.{COLUMN_OF[row['quantity']]}": list(row["limits"])
        for row in rows
        if row["quantity"] in COLUMN_OF and row["limits"]
    }
    page = {
        "place": local_path(str(table.folder)),
        "description": None if scenario is None else scenario.description,
        "summary": [
            ("cases", f"{len(table.rows)} of {planned}" if planned > len(table.rows) else str(len(table.rows))),
            ("finished", f"{table.column(STATUS).count('finished')} of {len(table.rows)}"),
            *([("inside all measured ranges", f"{inside.count('True')} of {len(inside)}")] if inside else []),
            ("varied", ", ".join(table.keys) or "nothing"),
            ("runs in this page", str(len(members))),
        ],
        "problems": [local_text(text) for text in problems],
        "hidden_blocks": len(blocks) - len(shown),
        "has_members": bool(members),
        "judged": judged,
        "pictures": [(one["label"], one["source"]) for one in pictures],
    }
    data = {
        "kind": "sweep",
        "name": name,
        "place": local_path(str(table.folder)),
        "columns": _columns(table, shown),
        "left_out": list(left_out),
        "measured": limits,
        "members": dict(members),
        "pictures": [one["data"] for one in pictures],
    }
    return Subject(key, "sweep", name, page, data)


def _columns(table: CaseTable, blocks: Sequence[str]) -> list[dict[str, Any]]:
    """Return names, roles and values; a column whose values are all numbers has numbers, an empty cell is null."""
    ends = [f"{block}{suffix}" for block in blocks for suffix in (".x_mm", ".rotation_deg")]
    roles = {"varied": table.keys, "case": (CASE,), "outcome": table.results, "block": ends}
    order = [CASE, *table.keys, *table.results, *ends]
    role = {name: kind for kind, names in roles.items() for name in names}
    known = (one for one in observables.OBSERVABLES.values() if one.title)
    labels = {one.name: {"label": one.title + (f" ({one.unit})" if one.unit else "")} for one in known}
    return [
        {
            "name": name,
            **labels.get(name, {}),
            "role": role[name],
            "values": table.column(name) if name == CASE else _values(table.column(name)),
        }
        for name in order
        if name in table.columns
    ]


def _values(texts: Sequence[str]) -> list[Any]:
    """Return the numbers of a column whose values are all finite numbers, else its texts; None for an empty cell."""
    try:
        numbers = [float(text) if text else None for text in texts]
    except ValueError:
        numbers = [math.nan]
    return numbers if all(one is None or math.isfinite(one) for one in numbers) else [text or None for text in texts]


@dataclass(frozen=True)
class StudyPage:
    """The parts of a study: pairs of what was found, and a table of texts with its title."""

    name: str
    description: str
    summary: Sequence[tuple[str, str]]
    title: str
    heads: Sequence[str]
    rows: Sequence[Sequence[str]]
    picture: bytes | None = None  # PNG
    problems: Sequence[str] = ()


def study_subject(key: str, study: StudyPage, place: str) -> Subject:
    """Return a study for a report."""
    picture = None if study.picture is None else f"data:image/png;base64,{b64encode(study.picture).decode()}"
    page = asdict(study) | {"picture": picture, "problems": [local_text(text) for text in study.problems]}
    where = local_path(place)
    return Subject(
        key, "study", study.name, page | {"place": where}, {"kind": "study", "name": study.name, "place": where}
    )
