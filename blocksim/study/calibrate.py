"""Calibration: values within their priors for which agreement with the repeats is most probable."""

import hashlib
import os
import re
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tomli_w

from blocksim.errors import BlocksimError, InvalidInputError, OutputExistsError, StoppedEarlyError
from blocksim.extras import load_module
from blocksim.options import takes
from blocksim.scenario import Document, Model, Scenario, Source, document_of, scenario_to_toml
from blocksim.scenario.document import locate
from blocksim.scenario.models.motion import FromTable
from blocksim.scenario.overrides import KeyPath, follow, format_key, with_value
from blocksim.simulation import files, interruption, schemes
from blocksim.study import calibrate_plan
from blocksim.study.answer import Overview, UnstoredResult
from blocksim.study.executors.ensemble import run_members
from blocksim.view import studies
from blocksim.view.style import Paper

TABLES: tuple[KeyPath, ...] = (("experiment", "table"), ("motion", "table"), ("sweep", "table"))
NOTE = "calibrated, see [provenance]"
_COMMENT = re.compile(r"""([^#"']*?)(\s*)(?:#\s*(.*?)\s*)?""")
"""What stands behind a value: the end of its list or table, blanks, and a comment."""


def scenario_text(
    document: Document,
    values: Mapping[str, object],
    provenance: Mapping[str, str],
    folder: Path,
    head: str,
    note: str = NOTE,
) -> str:
    """Return the text of a scenario file to stand in `folder`: values set, their notes in [provenance], `head` on top.

    Values that were set over the document before are written too; paths of tables are those seen from the folder.
    `note` is the comment behind every fitted value. Raises what building the scenario raises.
    """
    changed = document.with_values(values)
    changed = changed.with_values({format_key(("provenance", key)): text for key, text in provenance.items()})
    scenario, data = changed.build(), changed.data
    # keys that may name a table, by a path relative to the scenario's folder
    bodies = data.get("bodies", ())
    count = len(bodies) if isinstance(bodies, tuple) else 0
    tables = [*TABLES, *(("bodies", number, "motion", "table") for number in range(count))]
    for path in tables:
        named = follow(data, path)
        if isinstance(named, str):
            target = (changed.folder / named).resolve()
            data, _ = with_value(data, path, Path(os.path.relpath(target, folder.resolve())).as_posix())
    with suppress(BlocksimError):  # no scenario any more, half-way through
        text = document.source.text
        fitted = {override.path for override in changed.overrides[len(document.overrides) :]}
        for path in dict.fromkeys([*(override.path for override in changed.overrides), *tables]):
            if follow(data, path) != follow(Document.parse(text).data if text else {}, path):
                text = _edited(text, path, data, note if path in fitted and path[0] != "provenance" else "")
        text = f"# {head}\n{text}"
        found = replace(Document.parse(text, folder=folder), allow_outside=True).build()
        same = [one.model_copy(update={"motion": None}) for one in (found, scenario)]  # the hash has its content
        if Model(found).hash == Model(scenario).hash and same[0] == same[1]:
            return text
    experiment, motion = (follow(data, path) for path in TABLES[:2])
    resolved = scenario_to_toml(
        scenario,
        experiment_table=experiment if isinstance(experiment, str) else None,
        motion_table=motion if isinstance(motion, str) else None,
        body_tables={
            body.motion.table.digest: str(follow(data, ("bodies", number, "motion", "table")))
            for number, body in enumerate(scenario.bodies)
            if isinstance(body.motion, FromTable)
        },
    )
    return f"# {head}\n{resolved}"


def _edited(text: str, path: KeyPath, data: Mapping[str, object], note: str) -> str:
    """Return the text with the value at a path set, as it is in the data, and a note behind it.

    A comment behind the value that stood there was about that one, which is said.
    """
    places = locate(text)
    known = next((path[:size] for size in range(len(path), 0, -1) if path[:size] in places), ())
    value = toml_value(follow(data, path))
    if not known:  # in a table of its own at the end, or before all tables where it stands in none
        if len(path) == 1:
            return f"{format_key(path)} = {value}\n{text}"
        return f"{text.rstrip()}\n\n[{format_key(path[:1])}]\n{format_key(path[1:])} = {value}\n"
    lines, place, span = text.split("\n"), places[known], places[known].value
    if lines[place.key.line - 1].lstrip().startswith("[") and place.key == span:  # the head of its table
        lines.insert(place.key.line, f"{format_key(path[len(known) :])} = {value}")
        return "\n".join(lines)
    value = toml_value(follow(data, known))
    line = lines[span.line - 1]
    rest = line[span.column + span.length :]
    comment = _COMMENT.fullmatch(rest)
    if note and comment is not None:
        told = note if known == path else f"{path[-1]} {note}"
        before = f"; before: {comment[3]}" if comment[3] else ""
        gap = " " * max(2, span.length + len(comment[2]) - len(value))  # the comment stays in its column
        rest = f"{comment[1]}{gap}# {told}{before}"
    lines[span.line - 1] = line[: span.column] + value + rest
    return "\n".join(lines)


def toml_value(value: object) -> str:
    """Write a value as it stands in a TOML file, on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{format_key((str(key),))} = {toml_value(one)}" for key, one in value.items()) + " }"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    return tomli_w.dumps({"v": value}).removeprefix("v = ").rstrip("\n")


TAKEN = "{}: already exists; --overwrite replaces it, --out FILE writes elsewhere"


@dataclass(frozen=True, repr=False)
class Fit(UnstoredResult):
    """What a calibration found; `score` is of fresh samples, drawn independently, that no trial has seen."""

    what = "a calibration"
    picture = "trials"
    caption = "Fitted values"
    scenario: Scenario
    plan: calibrate_plan.CalibrationPlan
    best: calibrate_plan.Trial
    score: calibrate_plan.Score
    trials: int
    path: Path
    hits: tuple[calibrate_plan.Hit, ...]  # of the fresh members, a quantity each
    ties: tuple[calibrate_plan.Trial, ...] = ()  # all that are as good as the best, the best among them
    tried: tuple[calibrate_plan.Trial, ...] = ()

    @property
    def agrees(self) -> bool:
        """Return True if a member of the best trial or a fresh one is inside all ranges; if not, it is the nearest."""
        return self.best.score.inside + self.score.inside > 0

    def equally_good(self, prior: calibrate_plan.Prior) -> tuple[float, float]:
        """Return the least and the greatest of the equally good values of a key, in the unit of its prior."""
        numbers = [prior.number(trial.values[prior.key]) for trial in self.ties or (self.best,)]
        return min(numbers), max(numbers)

    def to_dict(self) -> dict[str, object]:
        """Return plain values for JSON."""
        low, high = self.score.interval
        return {
            "scenario": str(self.path),
            "found": self.agrees,
            "fitted": [
                {
                    "key": prior.key,
                    "prior": [prior.low, prior.high],
                    "unit": prior.unit,
                    "value": self.best.values[prior.key],
                    "at_bound": prior.lies_at_bound(self.best.values[prior.key]),
                    "equally_good": list(self.equally_good(prior)),
                }
                for prior in self.plan.priors
            ],
            "scatter": calibrate_plan.scatter_texts(self.plan.scatter),
            "experiment": self.plan.table.source,
            "trials": self.trials,
            "members": self.plan.members,
            "seed": self.plan.seed,
            "best_trial": self.best.number,
            "tied_trials": len(self.ties),
            "search_share_inside": self.best.score.share_inside,
            "share_inside": self.score.share_inside,
            "interval": [low, high],
            "fresh_members": self.score.members,
            "failed": self.score.failed,
            "quantities": [
                {
                    "block": hit.range.block,
                    "quantity": hit.range.column,
                    "range": [hit.range.lower, hit.range.upper],
                    "median": hit.median,
                    "share_inside": hit.share_inside,
                }
                for hit in self.hits
            ],
        }

    @property
    def probability(self) -> list[str]:
        """How probable agreement is with the fitted values."""
        score, tried = self.score, self.best.score
        if self.plan.scatter is None:
            verdict = "inside all ranges" if score.inside else f"not inside all ranges ({score.miss:.3g} off)"
            return [f"one run, without input scatter: {verdict}"]
        low, high = score.interval
        estimate = f"search estimate {tried.share_inside:.3f} ({tried.members} samples)"
        return [
            f"P(inside all ranges) = {score.share_inside:.3f}, 95 % interval {low:.3f} to {high:.3f} (Clopper-Pearson)",
            f"of {score.members} fresh random samples; {estimate}",
        ]

    @property
    def remarks(self) -> list[str]:
        """Measured values far from others, values at a bound of their prior, failures, and where the scenario is."""
        values = [(prior, self.best.values[prior.key]) for prior in self.plan.priors]
        lines = [
            f"warning: {prior.key} = {value} lies at a bound of its prior; a wider one might fit better"
            for prior, value in values
            if prior.lies_at_bound(value)
        ]
        failed = self.score.failed
        if failed:
            count = f"{failed} of {self.score.members} fresh samples"
            lines.append(f"{count} failed or cannot be simulated; they count as outside")
        return [*self.plan.table.messages, *lines, f"written: {self.path}"]

    def overview(self) -> Overview:
        """Return the fitted values and, where trials tie, the ranges of those that are equally good."""
        heads = ("key", "prior", "equally good", "written") if len(self.ties) > 1 else ("key", "prior", "fitted")
        rows = []
        for prior in self.plan.priors:
            tied = (prior.range_of(*self.equally_good(prior)),) if len(self.ties) > 1 else ()
            rows.append((prior.key, prior.range_of(prior.low, prior.high), *tied, str(self.best.values[prior.key])))
        found = "" if self.agrees else ", nothing inside all ranges"
        return Overview(
            f"{self.name}: best of {self.trials} trials{found}",
            heads,
            rows,
            lines=self.probability,
            notes=self.remarks,
            summary=[("trials", str(self.trials)), ("P(inside all ranges)", f"{self.score.share_inside:.3f}")],
        )

    def draw(self, path: Path, title: str, paper: Paper) -> None:
        """Draw how good every trial is over each fitted key.

        Raises InvalidInputError for an unknown format or too small a page, OutputError.
        """
        some = any(trial.score.inside for trial in self.tried)
        label = "share inside all ranges" if some else "distance from the ranges (0 to 1)"
        scores = [trial.score.share_inside if some else trial.score.miss for trial in self.tried]
        best = np.array([trial in self.ties for trial in self.tried])
        panels = [
            studies.TrialPanel(
                f"{prior.key} ({prior.unit})" if prior.unit else prior.key,
                np.array([prior.number(trial.values[prior.key]) for trial in self.tried]),
                (prior.low, prior.high),
                is_log=prior.log,
            )
            for prior in self.plan.priors
        ]
        studies.draw_trials(panels, np.array(scores), best, label, path, title=title, paper=paper)


@takes(calibrate_plan.CalibrateOptions)
def calibrate(scenario: Source, options: calibrate_plan.CalibrateOptions) -> Fit:
    """Fit inputs to measured repeats so that agreement is probable under the scatter of the other inputs.

    Finds the best values, measures how probable agreement is with them, and writes a scenario with these values and
    their provenance. Beside it every trial is kept as it ends, in FILE.trials.jsonl; a finished calibration that is
    resumed leaves its file as it is. `on_start` is called with the set of kernels, `on_trial` with every new trial, the
    best so far, and how many are to be made. Raises ScenarioError, InputMissingError without an experiment table,
    InvalidInputError, OutputExistsError, OutputError, UnavailableError without the extra `study`, and StoppedEarlyError
    on Ctrl-C.

    >>> blocks, friction = "scenarios/three_blocks_nonsmooth.toml", {"friction.block_block": {"from": 0.2, "to": 0.4}}
    >>> calibrate(blocks, friction, trials=4, members=1)
    <Fit of three_blocks_nonsmooth: best of 4 trials, nothing inside all ranges>
    """
    plan = calibrate_plan.calibration_plan(document_of(scenario), options)
    options.on_start(schemes.kernels_of(plan.base))
    resume, overwrite = options.resume, options.overwrite
    name = hashlib.sha256(str(plan.fingerprint()).encode()).hexdigest()[:12]
    path = Path(options.out or files.RESULTS / plan.base.name / f"calibrate-{name}" / "scenario.toml")
    journal = path.parent / f"{path.stem}.trials.jsonl"
    for package in ("optuna", "scipy.stats.qmc"):  # before anything is written
        load_module(package, calibrate_plan.PURPOSE)
    if path.is_dir():
        raise OutputExistsError(f"{path}: this is a folder; a file name is needed")
    has_trials = journal.exists() and journal.stat().st_size > 0
    if path.exists() and not overwrite and not (resume and has_trials):
        raise OutputExistsError(TAKEN.format(path))
    if has_trials and not (resume or overwrite):
        how = "--resume continues them, --overwrite starts again"
        raise OutputExistsError(f"{journal}: has trials of a calibration; {how}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if overwrite and not resume and journal.exists():
            calibrate_plan.refuse_other_file(journal)
            journal.unlink()
    except OSError as error:
        raise OutputExistsError(f"{path.parent}: cannot be created: {error.strerror}") from error
    kept = path if path.exists() and not overwrite else None
    best, ties, tried = _searched(plan, journal, options, kept)
    count = 1 if plan.scatter is None else options.fresh_members
    fresh = calibrate_plan.members_of(plan.scatter, best.values, count, plan.seed, calibrate_plan.FRESH)
    members = list(run_members(plan.bare, fresh))
    score = calibrate_plan.score_of(members, plan.ranges)
    hits = calibrate_plan.hits_of(members, plan.ranges)
    fit = Fit(plan.base, plan, best, score, options.trials, path, hits, ties, tried)
    note = f"one of {len(ties)} equally good, see [provenance]" if len(fit.ties) > 1 else NOTE
    which = f"one of {len(ties)} equally good trials: " if len(fit.ties) > 1 else ""
    shown = ", ".join(f"{key} = {value}" for key, value in best.values.items())
    head = f"{Path(plan.document.source.where).name} calibrated by blocksim: {which}{shown}"
    text = scenario_text(plan.document, best.values, _provenance(fit), path.parent, head, note)
    if kept is None:
        files.write_text(path, text)
    elif kept.read_bytes() != text.encode():
        raise OutputExistsError(TAKEN.format(kept))
    return fit


def _searched(
    plan: calibrate_plan.CalibrationPlan, journal: Path, options: calibrate_plan.CalibrateOptions, kept: Path | None
) -> tuple[calibrate_plan.Trial, tuple[calibrate_plan.Trial, ...], tuple[calibrate_plan.Trial, ...]]:
    """Return the best trial, the first of equally good ones, all that tie with it, the best among them, and all."""
    tried: list[calibrate_plan.Trial] = []
    trials = options.trials

    def evaluate(values: Mapping[str, object]) -> calibrate_plan.Score:
        members = calibrate_plan.members_of(plan.scatter, values, plan.members, plan.seed)
        return calibrate_plan.score_of(run_members(plan.bare, members), plan.ranges)

    with calibrate_plan.open_journal(journal, plan.fingerprint()) as study, interruption.interruptible():
        done = len(calibrate_plan.complete_trials(study))
        if kept is not None and done < trials:  # they would change the file
            raise OutputExistsError(TAKEN.format(kept))
        try:
            for trial in calibrate_plan.search(plan.priors, evaluate, study, trials=trials, seed=plan.seed):
                tried.append(trial)
                if trial.number > done:
                    options.on_trial(trial, max(tried, key=lambda one: one.score.value), trials)
        except KeyboardInterrupt:
            raise StoppedEarlyError(
                f"stopped after {len(calibrate_plan.complete_trials(study))} of {trials} trials; --resume runs the rest"
            ) from None
    if not tried:
        raise InvalidInputError("at least one trial is needed")
    best = max(tried, key=lambda one: one.score.value)
    # as good are those of which as many members are inside, or none is, and as far off; how near the middle of their
    # ranges members are inside only steers the search: no measurement prefers it
    inside, miss = best.score.inside, best.score.miss
    ties = (one for one in tried if one.score.inside == inside and (inside > 0 or one.score.miss == miss))
    return best, tuple(ties), tuple(tried)


def _provenance(fit: Fit) -> dict[str, str]:
    """Say of every fitted value where it comes from, and among which equally good ones it is one of several."""
    plan, score, table = fit.plan, fit.score, Path(fit.plan.table.source).name
    if plan.scatter is None:
        inside = "inside" if score.inside else "not inside"
        found = f"seed {plan.seed}, {fit.trials} trials of one run, {inside} all ranges of {table}"
    else:
        low, high = score.interval
        scatter = ", ".join(f"{key} {words}" for key, words in calibrate_plan.scatter_texts(plan.scatter).items())
        found = (
            f"seed {plan.seed}, {fit.trials} trials of {plan.members} samples, P(inside all ranges) "
            f"{score.share_inside:.3f} [{low:.3f}, {high:.3f}] of {score.members} fresh samples, {table}, "
            f"scatter (SI): {scatter}"
        )
    verb = "calibrated" if fit.agrees else "not calibrated (nothing inside all ranges, nearest values)"
    texts = {}
    for prior in plan.priors:
        span = prior.range_of(*fit.equally_good(prior))
        among = f", one of {len(fit.ties)} equally good trials ({span})" if len(fit.ties) > 1 else ""
        texts[prior.key] = f"{verb}{among}, prior {prior.range_of(prior.low, prior.high)}, {found}"
    return texts
