"""Up to which value of a key a structure can be in equilibrium, by statics alone: milliseconds instead of runs.

A key that changes forces and nothing else, in proportion, needs one linear programme for each end of the range in which
there is an equilibrium. For any other (a tilt, a thickness, a friction, a position) there is an equilibrium or none at
each value, and values are tried as `limit` tries them. What statics leaves out and what its answers mean:
blocksim/statics/programme.py.
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import ClassVar, NamedTuple, Self

import numpy as np
from pydantic import BaseModel

from blocksim.errors import BlocksimError, ExitCode, InvalidInputError
from blocksim.options import takes
from blocksim.scenario import Document, Model, Source, document_of
from blocksim.statics.blockwork import MOST_BLOCKS, Blockwork
from blocksim.statics.joint_forces import BlockMotion, JointForce, block_motions, joint_forces
from blocksim.statics.programme import FEW, Equilibrium, Programme
from blocksim.study import limit_plan, sweep
from blocksim.study.answer import Overview, Study, with_unit
from blocksim.study.limit_answer import UNIT, RangeAnswer
from blocksim.study.limit_plan import LimitPlan, Number
from blocksim.study.rows import Head
from blocksim.study.sweep_folder import FolderKind
from blocksim.view import style, thrust

POSSIBLE, NONE = "possible", "none"
SAME = 1e-9  # of the weight: difference of forces that is none
SLIGHT = 1e-4  # of a bound: an estimate that is nearer says nothing else
EXACT = 1e-6  # of a value: a bracket costs little
ISLAND = 12  # halvings of the spacing of a scan, about the least that is missing to an equilibrium


class StaticLimit(BaseModel, frozen=True):
    """Where equilibrium ends: the values on both sides, the same where a linear programme gives the value itself."""

    low: float
    high: float
    below: str
    above: str
    estimate: float | None = None  # of joints that slip without opening, where that is another value
    joints: tuple[JointForce, ...] = ()
    mechanism: tuple[BlockMotion, ...] = ()

    @property
    def bound(self) -> float:
        """The value on the side without equilibrium: beyond it no structure stands."""
        return self.high if self.above == NONE else self.low

    @property
    def side(self) -> str:
        """Where no equilibrium exists, seen from the bound."""
        return "above" if self.above == NONE else "below"

    @property
    def value(self) -> float:
        """The value on the side where an equilibrium is possible."""
        return self.low if self.above == NONE else self.high

    def lines(self, unit: str) -> Iterator[str]:
        """Yield the answer in words."""
        yield f"no equilibrium {self.side} {with_unit(self.bound, unit)}"
        if self.high > self.low:
            yield f"an equilibrium is possible at {with_unit(self.value, unit)}"
        if self.estimate is not None:
            yield f"joints that slip without opening: about {with_unit(self.estimate, unit)}, an estimate"


class StaticAnswer(RangeAnswer, frozen=True):
    """Where equilibrium begins or ends along a key, from the smallest value up; no limits where nothing changes."""

    files: ClassVar[FolderKind] = FolderKind(
        "static", "a static limit", "limit", {r"static\.csv": rf"value{UNIT},verdict"}
    )
    picture: ClassVar[str] = "thrust"
    caption: ClassVar[str] = "Statics"
    tolerance: float
    blocks: int
    is_linear: bool  # the key changes forces alone, and in proportion
    limits: tuple[StaticLimit, ...]
    estimates: tuple[float, ...] = ()  # of joints that slip without opening, where statics sets no bound

    @classmethod
    def of(cls, plan: LimitPlan, folder: Path, found: "StaticSearch") -> Self:
        """Make the answer of a search."""
        return cls.model_validate(
            {
                **cls.fields_of(plan),
                "blocks": found.blocks,
                "is_linear": found.is_linear,
                "limits": found.limits,
                "estimates": found.estimates,
                "folder": folder,
                "heads": (str(Head("value", plan.unit)), "verdict"),
                "cells": sorted(found.verdicts.items()),
            }
        )

    @property
    def is_possible(self) -> bool:
        """Whether an equilibrium is possible at any value."""
        return any(row[1] == POSSIBLE for row in self.cells)

    def overview(self) -> Overview:
        """Return what is known of both ends of the range and of every limit."""
        lines = [*(line for one in self.limits for line in one.lines(self.unit)), *self._unbounded()]
        shown = {self.low, self.high, *(end for one in self.limits for end in (one.low, one.high))}
        notes = ["statics: rigid blocks as placed, Coulomb's friction; springs and impacts have no part in it"]
        if self.is_possible:
            notes.append("whether a possible equilibrium is reached from rest, runs decide: leave --static out")
        if not self.is_linear:
            notes.append(self.unseen)
        notes.append(f"{len(self.cells)} values: {self.folder / 'static.csv'}")
        if self.limits:
            notes.append(f"thrust and mechanism: blocksim plot {self.folder}")
        return Overview(
            f"{self.key}, equilibrium of {self.blocks} blocks by statics",
            (f"value {self.unit}".rstrip(), "verdict"),
            [[f"{value:.9g}", str(verdict)] for value, verdict in self.cells if value in shown],
            left=2,
            lines=lines,
            notes=notes,
            summary=[("key", self.key), ("blocks", str(self.blocks)), *(("limit", line) for line in lines)],
            code=ExitCode.SUCCESS if self.limits else ExitCode.OUTSIDE,
        )

    def _unbounded(self) -> Iterator[str]:
        """Yield what is so where nothing changes, and where joints may give way that statics takes for locked."""
        values = "all values of the range" if self.is_linear else f"all {len(self.cells)} values that were tried"
        if not (self.limits or self.is_possible):
            yield f"no equilibrium at {values}"
        elif not self.limits:
            yield f"statics sets no bound in this range: an equilibrium is possible at {values}"
        if self.estimates or (self.is_possible and not self.limits):
            at = " and ".join(with_unit(value, self.unit) for value in self.estimates)
            about = f": at about {at}, an estimate" if at else ""
            yield f"joints that slip without opening may give way earlier{about}"

    def draw(self, path: Path, title: str, paper: style.Paper) -> None:
        """Draw the first limit: forces in joints with the line of thrust, and the mechanism beside them."""
        if not self.limits:
            raise InvalidInputError(f"{self.folder}: nothing changes within its range; nothing to draw")
        one = self.limits[0]
        setting = limit_plan.setting(self.key, one.value, self.unit, is_whole=self.is_whole)
        model = Model(Document.read(self.folder / self.files.plan, is_stored=True).with_values(setting))
        heads = f"an equilibrium is possible at {self.key} = {with_unit(one.value, self.unit)}", "a mechanism beyond it"
        thrust.draw_thrust(model, one.joints, one.mechanism, heads, path, title, paper)


@takes(limit_plan.LimitOptions)
def static_limit(scenario: Source, options: limit_plan.LimitOptions) -> StaticAnswer:
    """Find up to which value of a key a structure can be in equilibrium: a bound, no structure stands beyond it.

    Raises ScenarioError; InvalidInputError for options of runs (`stands`, `stiffer`, executors), and where something
    else acts than loads that are the same from time zero on; OutputExistsError where the folder is not free.

    >>> overlap = {"structures.0.overlap": {"from": "12 mm", "to": "28 mm"}}
    >>> round(static_limit("scenarios/three_blocks_nonsmooth.toml", overlap, out="results/static").limits[0].value, 2)
    21.33
    """
    return find_static(limit_plan.read_limit(document_of(scenario), options), options)


def bound_of(plan: LimitPlan) -> StaticLimit | None:
    """Return the only limit by statics in a range; None where there are none or several, or statics has no answer.

    Nor is it asked of so many blocks that it would take as long as runs.
    """
    if len(plan.model_at(plan.span.high).bodies) > MOST_BLOCKS:
        return None
    with suppress(InvalidInputError):  # such as a load that changes with time, or a block that rests on nothing
        limits = search_statics(plan).limits
        return limits[0] if len(limits) == 1 else None
    return None


def find_static(plan: LimitPlan, options: limit_plan.LimitOptions) -> StaticAnswer:
    """Search as planned; see `static_limit`."""
    of_runs = [name for name in OF_RUNS if getattr(options, name) != getattr(limit_plan.LimitOptions, name)]
    if of_runs:
        flags = " and ".join(f"--{name}" for name in of_runs)
        raise InvalidInputError(f"statics makes no runs: leave {flags} out")
    found = search_statics(plan)
    base, kind = plan.model_at(plan.span.low), StaticAnswer.files
    folder = sweep.make_folder(options.out, base, kind, plan.name, overwrite=options.overwrite)
    answer = StaticAnswer.of(plan, folder, found)
    answer.write()
    return answer


OF_RUNS = ("stands", "stiffer", "executor", "jobs", "scheduler")  # options


class StaticSearch(NamedTuple):
    """What a search has come to."""

    blocks: int
    is_linear: bool
    limits: list[StaticLimit]
    verdicts: dict[Number, str]  # of all values that were tried
    estimates: list[Number]  # where joints may slip without opening, within the range and where there is no bound


Found = tuple[list[StaticLimit], dict[Number, str], list[Number]]


@contextmanager
def _at(plan: LimitPlan, value: Number) -> Iterator[None]:
    """Name the value at which statics has no answer. Raises InvalidInputError."""
    try:
        yield
    except BlocksimError as error:
        where = f"{plan.key} = {with_unit(value, plan.unit)}"
        raise InvalidInputError(f"{where}: {str(error).splitlines()[0]}") from error


def _structure_at(plan: LimitPlan, value: Number) -> Blockwork:
    with _at(plan, value):
        return Blockwork.of(plan.model_at(value))


def search_statics(plan: LimitPlan) -> StaticSearch:
    """Return where equilibrium begins or ends in the range of a plan. Raises InvalidInputError; see `Blockwork.of`."""
    span = plan.span
    middle = next(iter(span.between(span.low, span.high, parts=2)), span.low)
    low, half, high = (_structure_at(plan, at) for at in (span.low, middle, span.high))
    is_linear = not span.is_whole and all(low.has_joints_of(one) for one in (half, high))
    if is_linear:
        share = (middle - span.low) / (span.high - span.low)
        away = half.forces - ((1.0 - share) * low.forces + share * high.forces)
        is_linear = float(np.abs(away).max()) <= SAME * float(np.abs(low.forces).sum())
    blocks = len(low.names)
    return StaticSearch(blocks, is_linear, *(_ends(plan, low, high) if is_linear else _tried(plan)))


def _ends(plan: LimitPlan, low: Blockwork, high: Blockwork) -> Found:
    """Return the limits of a key that changes forces in proportion, and verdicts at both ends of the range."""
    programme, change, width = Programme(low), high.forces - low.forces, plan.span.high - plan.span.low
    limits, verdicts = [], dict.fromkeys((plan.span.low, plan.span.high), NONE)
    down, up = (programme.greatest(low.forces, sign * change) for sign in (-1.0, 1.0))
    if down is None or up is None:
        return [], verdicts, []
    possible = [at for at, share in zip(verdicts, (0.0, 1.0), strict=True) if -down.factor <= share <= up.factor]
    verdicts |= dict.fromkeys(possible, POSSIBLE)
    for sign, end in ((-1.0, down), (1.0, up)):
        if 0.0 < sign * end.factor < 1.0:
            factor = programme.estimate(low.forces, sign * change, end.factor) if len(low.names) <= FEW else end.factor
            value, estimate = (plan.span.clip(plan.span.low + sign * one * width) for one in (end.factor, factor))
            limit = StaticLimit(
                low=value,
                high=value,
                below=POSSIBLE if sign > 0.0 else NONE,
                above=NONE if sign > 0.0 else POSSIBLE,
                estimate=estimate if abs(estimate - value) > SLIGHT * abs(value) else None,
                joints=joint_forces(low, end),
                mechanism=block_motions(low, end),
            )
            limits.append(limit)
            verdicts[value] = POSSIBLE
    estimates: list[Number] = []
    even = programme.even(low.forces, change, 1.0) if len(low.names) <= FEW else None
    if even is not None:
        base = even[1]  # where no joint is locked by more than the forces need
        for sign, end in ((-1.0, down), (1.0, up)):
            at = base + sign * programme.estimate(low.forces + base * change, sign * change, end.factor - sign * base)
            if 0.0 < at < 1.0 and not 0.0 < sign * end.factor < 1.0:
                estimates.append(plan.span.clip(plan.span.low + at * width))
    return limits, verdicts, estimates


def _tried(plan: LimitPlan) -> Found:
    """Return the limits of a key of which every value is tried by itself, and all verdicts.

    Where there is no equilibrium on either side, values are tried about the one to which the least is missing.
    """
    tried: dict[Number, tuple[Blockwork, Equilibrium]] = {}
    verdicts: dict[Number, str] = {}
    nearest: dict[Number, tuple[float, float]] = {}  # the less is missing the greater; no two are equal
    tolerance = min(plan.tolerance, EXACT)
    while values := limit_plan.next_values(plan.span, verdicts, tolerance, nearest, ISLAND):
        for value in values:
            structure = _structure_at(plan, value)
            with _at(plan, value):
                programme = Programme(structure)
                tried[value] = structure, programme.carries(structure.forces)
                verdicts[value] = POSSIBLE if tried[value][1].factor else NONE
                if verdicts[value] == NONE and len(structure.names) <= FEW:
                    nearest[value] = -programme.missing(structure.forces), value
    limits = []
    for change in limit_plan.changes_in(verdicts):
        stands, falls = (change.low, change.high) if change.above == NONE else (change.high, change.low)
        joints, mechanism = joint_forces(*tried[stands]), block_motions(*tried[falls])
        limits.append(StaticLimit(**vars(change), joints=joints, mechanism=mechanism))
    return limits, verdicts, []


def repeat_static(answer: StaticAnswer, _: sweep.Replay, out: Path) -> StaticAnswer:
    """Search again in another folder."""
    document = Document.read(answer.folder / answer.files.plan, is_stored=True)
    options = limit_plan.LimitOptions(answer.vary, tolerance=answer.tolerance, out=out)
    return find_static(limit_plan.read_limit(document, options), options)


STATIC = Study(StaticAnswer, repeat_static)
