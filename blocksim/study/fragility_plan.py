"""What `fragility` runs: members of a scenario drawn at every intensity, each by itself.

The draws of one intensity are independent of those of all others, and random rather than stratified: only then are the
counts binomial, and independent of one another, as exact limits and the likelihood of a curve assume. With common
draws, or a Latin hypercube, the intervals would be too narrow or too wide. Member i at an intensity is the same
whatever the other intensities are and however many members are drawn.

Stripes are records that all intensities share, each of them equally often at each (multiple stripe analysis; Jalayer,
dissertation, Stanford 2003): member i has record i modulo their number. Curves of these have wider intervals, see
`blocksim.analysis.lognormal`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated

from blocksim.errors import InvalidInputError
from blocksim.options import Option, Overwrite, takes
from blocksim.scenario import Document, Sweep, overrides, scenario_hash
from blocksim.scenario.models.study import Uniform, Variation
from blocksim.silence import silent
from blocksim.simulation.provenance import code_hash
from blocksim.study import answer, criterion, executors, limit_plan, manifest, plan, rows, runs

INTENSITY, SCATTER, STRIPES, FAILS = "--intensity", "--scatter", "--stripes", "--fails"
COLLAPSE = "outcome = fell"
MEMBERS = 64
MOST_SEED = 2**53
NO_SCATTER = (
    "no scatter: give --scatter KEY=MEAN+-SD (or KEY=FROM:TO, KEY=a,b,c), --stripes KEY=a,b,c, or a [sweep] table with "
    "distributions"
)
OnRow = Callable[[int, int, rows.Row], None]


@dataclass(frozen=True)
class FragilityOptions(executors.Execution):
    """Intensities, what scatters at each of them, what counts as failure, and how members are run and kept."""

    intensity: Annotated[
        Mapping[str, plan.Values],
        plan.variations_option(
            "The key that is the intensity: KEY=a,b,c or KEY=FROM:TO:COUNT (:log at the end spaces them "
            "logarithmically).",
            "KEY=VALUES",
            'One key and its values, {"motion.scale": [0.5, 1.0, 1.5]} or {"from": a, "to": b, "count": n}.',
            INTENSITY,
            is_repeatable=False,
        ),
    ]
    scatter: Annotated[
        Mapping[str, plan.Values] | None,
        plan.variations_option(
            "Quantity to sample: KEY=MEAN+-SD, KEY=FROM:TO or equally likely values, KEY=a,b,c. Repeatable. Default: "
            "the distributions of [sweep].",
            "KEY=MEAN+-SD",
            'The quantities drawn for each sample by itself: {"mean": m, "sd": s}, {"from": a, "to": b} or a list of '
            "equally likely values, such as records (default: the distributions of [sweep]).",
            SCATTER,
        ),
    ] = None
    _: KW_ONLY
    stripes: Annotated[
        Mapping[str, plan.Values] | None,
        plan.variations_option(
            "Records that all intensities share, each once at each of them, such as motion.table=a.csv,b.csv. "
            "Repeatable: keys whose values go together.",
            "KEY=a,b,c",
            'Records, {"motion.table": ["a.csv", "b.csv"]}, of which every intensity has each equally often, by '
            "default once; several keys go together. The curve's intervals are then those of common records.",
            STRIPES,
        ),
    ] = None
    members: Annotated[
        int | None,
        Option(
            f"Samples at every intensity (default: {MEMBERS}, or one of each record of {STRIPES}).",
            ("--samples", "--members"),
            "N",
            least=1,
        ),
    ] = None
    fails: Annotated[
        str | Sequence[str],
        Option(
            'What counts as failure, such as "moved > 50 mm" or "outcome = slid | fell". Separated by '
            f'commas: all must hold; repeated: any one suffices (default: "{COLLAPSE}").',
            metavar="CONDITIONS",
            python='What counts as failure, such as "moved > 50 mm" or "outcome = slid | fell", any of several '
            "(see `blocksim.study.criterion`).",
            is_repeatable=True,
        ),
    ] = COLLAPSE
    seed: Annotated[int, Option("Random seed.", metavar="S", least=0)] = 0
    shard: Annotated[
        manifest.Shard,
        Option(
            "Run only samples I, I + N, ... (job arrays); then once without, for the curve.",
            metavar="I/N",
            read=manifest.Shard.parse,
        ),
    ] = manifest.WHOLE
    retry_failed: Annotated[bool, Option("Rerun samples that did not finish.")] = False
    out: Annotated[
        Path | str | None, Option("Folder to write (default: results/NAME/fragility-HASH).", metavar="DIR")
    ] = None
    overwrite: Overwrite = False
    on_row: OnRow = silent


@dataclass(frozen=True)
class FragilityPlan:
    """One study: intensities that increase, and what scatters at each of them."""

    document: Document  # without [sweep]
    head: rows.Head  # key and unit of the intensity
    levels: Mapping[float, object]  # value of the key by its number in that unit
    scatter: Sweep | None  # None where there are stripes alone
    members: int  # at every intensity
    seed: int
    fails: tuple[criterion.Criterion, ...]  # any of them
    stripes: Mapping[str, tuple[object, ...]] = field(default_factory=dict)  # values of a key by record

    @property
    def records(self) -> int:
        """How many records the intensities share; 0 where every draw is independent."""
        return len(next(iter(self.stripes.values()), ()))

    @property
    def spread(self) -> Mapping[str, Variation]:
        """Everything that differs between the members of an intensity, by key."""
        return {**self.stripes, **({} if self.scatter is None else self.scatter.vary)}

    @property
    def name(self) -> str:
        """A hash of all that decides a member; neither their number nor what counts as failure does."""
        levels = [self.head.key, *map(str, self.levels.values())]
        scatter = None if self.scatter is None else self.scatter.as_table()
        about = [scenario_hash(self.document.build()), levels, scatter, self.seed, code_hash()]
        if self.stripes:
            about.append({key: list(map(str, values)) for key, values in self.stripes.items()})
        tables = plan.table_digests(self.document, self.spread)
        return runs.short_hash([*about, tables] if tables else about)

    @cached_property
    def cases(self) -> plan.Cases:
        """All members: the first of every intensity, the second of every intensity, and so on.

        More members come after those that are there. Raises ScenarioError where a distribution gave a value that its
        key cannot have, InvalidInputError where no case can be simulated.
        """
        vary = {} if self.scatter is None else self.scatter.vary
        draws = {key: self._draws(key, values) for key, values in vary.items()}
        shared = {  # all intensities of a member have the same record
            key: tuple(values[member % len(values)] for member in range(self.members) for _ in self.levels)
            for key, values in self.stripes.items()
        }
        design = plan.Design({self.head.key: tuple(self.levels.values()) * self.members, **shared, **draws})
        if self.scatter is not None:
            plan.refuse_wrong_draws(self.document, self.scatter, design)
        striped = Sweep.model_validate({"mode": "list", **design.columns})
        heads = {
            head.key: head for head in (*rows.heads_of(striped), *(rows.heads_of(self.scatter) if self.scatter else ()))
        }
        cases = plan.cases_of(self.document, striped)
        return replace(cases, heads=(self.head, *(heads[key] for key in self.spread)))

    def _draws(self, key: str, values: Variation) -> tuple[object, ...]:
        """Return the values of a key in the order of the cases."""
        is_whole = limit_plan.takes_whole(self.document, key) and not isinstance(values, tuple)
        if is_whole and isinstance(values, Uniform):
            values = replace(values, low=values.low - 0.5, high=values.high + 0.5)  # so that its ends are as likely
        by_level = []
        for number in self.levels:
            level = answer.with_unit(number, self.head.unit, 6)
            names = (overrides.format_key(overrides.parse_key(one)) for one in (key, self.head.key))
            name = f"{' where '.join(names)} = {level}"
            places = plan.open_interval(plan.generator(self.seed, name).random(self.members))
            by_level.append(plan.draw_values(values, places))
        together = [value for member in zip(*by_level, strict=True) for value in member]
        return tuple(round(rows.si_number(value)) for value in together) if is_whole else tuple(together)


@takes(FragilityOptions)
def read_fragility(document: Document, options: FragilityOptions) -> FragilityPlan:
    """Return the plan of a study; without `scatter`, the [sweep] table of the scenario counts if it has distributions.

    `members` is their number at every intensity (default: 64, or one a record of `stripes`). Raises ScenarioError for
    keys and values that the scenario cannot have, InvalidInputError for a wrong criterion, anything but one intensity,
    nothing that scatters, stripes that are not all equally often there, and too many members.
    """
    fails, seed = options.fails, options.seed
    criteria = tuple(criterion.read_criterion(text, FAILS) for text in ([fails] if isinstance(fails, str) else fails))
    bare = document.without_sweep()
    given = plan.Variations.of(options.intensity)
    if len(given) != 1:
        message = f"one key is the intensity, not {len(given)}: give {INTENSITY} KEY=a,b,c or KEY=FROM:TO:COUNT once"
        raise InvalidInputError(message)
    head, levels = limit_plan.typed_levels(bare, given, INTENSITY)
    wrong = [value for number, value in levels.items() if number <= 0.0]
    if wrong:
        message = f"{INTENSITY} {given.texts[head.key]}: {wrong[0]} is not above 0, as a lognormal curve needs"
        raise InvalidInputError(message)
    shared = _stripes(bare, plan.Variations.of(options.stripes or {}))
    records = len(next(iter(shared.values()), ()))
    members = (records or MEMBERS) if options.members is None else options.members
    if members < 1 or members * len(levels) > plan.MOST_CASES or not 0 <= seed <= MOST_SEED:
        raise InvalidInputError(
            f"{members} samples at {len(levels)} intensities with seed {seed}: 1 to {plan.MOST_CASES} runs are possible"
        )
    if records and members % records:
        raise InvalidInputError(
            f"{members} samples of {records} records: each must be there equally often; give a multiple of {records}"
        )
    spread = _scatter(document, plan.Variations.of(options.scatter or {}), needed=not shared)
    keys = [overrides.parse_key(key) for key in (head.key, *shared, *(spread.vary if spread is not None else ()))]
    twice = next((key for i, key in enumerate(keys) if key in keys[:i]), None)
    if twice == keys[0]:
        raise InvalidInputError(f"{head.key} is the intensity; it cannot scatter too")
    if twice is not None:
        raise InvalidInputError(f"{overrides.format_key(twice)} is given as stripes; it cannot be drawn too")
    return FragilityPlan(bare, head, levels, spread, members, seed, criteria, shared)


def _stripes(document: Document, given: plan.Variations) -> dict[str, tuple[object, ...]]:
    """Return the values of each key by record."""
    if not given:
        return {}
    shared = {
        key: plan.levels_of(values)
        for key, values in plan.build_distributions(document, given, STRIPES, "list").vary.items()
    }
    for key, values in shared.items():
        if len(set(map(str, values))) < len(values) or len(values) == 1:
            why = "one record does not scatter; set it with --set" if len(values) == 1 else "a record is given twice"
            raise InvalidInputError(f"{STRIPES} {given.texts[key]}: {why}")
    return shared


def _scatter(document: Document, given: plan.Variations, *, needed: bool) -> Sweep | None:
    if given:
        spread = plan.build_distributions(document.without_sweep(), given, SCATTER, "normal")
        constant = next(
            (key for key, values in spread.vary.items() if len(set(map(str, plan.levels_of(values)))) == 1), None
        )
        if constant is not None:
            raise InvalidInputError(f"{SCATTER} {given.texts[constant]}: one value does not scatter; set it with --set")
        return spread
    own = document.build().sweep
    if own is None or not own.is_sampled:
        if needed:
            raise InvalidInputError(NO_SCATTER)
        return None
    return own
