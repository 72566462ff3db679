"""The scatter of inputs, of fitted ones about their fitted values: what the members of a trial differ by."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import sqrt

from blocksim.scenario import Sweep
from blocksim.scenario.keys import parse_key
from blocksim.scenario.models.variation import Uniform, Variation, written
from blocksim.study.calibrate.prior import si_number
from blocksim.study.sampling.modes import design_of

SAME = "sobol"  # the same points for every trial: trials differ by their values only
FRESH = "normal"  # independent draws, from streams of their own


@dataclass(frozen=True)
class Scatter:
    """Distributions of scenario keys; `plan` is None where nothing scatters."""

    plan: Sweep | None

    def members(self, fitted: Mapping[str, object], count: int, seed: int) -> Iterator[dict[str, object]]:
        """Yield the values of the members of a trial: the same points of the unit cube for every trial."""
        return self._drawn(fitted, SAME, count, seed)

    def fresh_members(self, fitted: Mapping[str, object], count: int, seed: int) -> Iterator[dict[str, object]]:
        """Yield the values of members drawn independently, from random numbers that no trial has seen."""
        return self._drawn(fitted, FRESH, count, seed)

    def _drawn(self, fitted: Mapping[str, object], mode: str, count: int, seed: int) -> Iterator[dict[str, object]]:
        if self.plan is None:
            yield from (dict(fitted) for _ in range(count))
            return
        plan = self.plan.model_copy(update={"mode": mode, "samples": count, "seed": seed})
        names = {parse_key(key): key for key in fitted}
        for row in design_of(plan):
            values = dict(fitted)
            for key, value in row.items():
                name = names.get(parse_key(key), key)
                values[name] = about(plan.vary[key], value, fitted[name]) if name in fitted else value
            yield values

    def described(self) -> dict[str, str]:
        """Return every key with its distribution in words."""
        return {} if self.plan is None else {key: in_words(values) for key, values in self.plan.vary.items()}


def about(distribution: Variation, drawn: object, fitted: object) -> object:
    """Return a drawn value moved so that the distribution lies about the fitted value.

    By the difference to its mean or middle, or by the ratio where its logarithm is evenly distributed.
    """
    assert not isinstance(distribution, tuple)  # noqa: S101 - levels are refused when the plan is read
    number, centre = si_number(drawn), si_number(fitted)
    if isinstance(distribution, Uniform) and distribution.scale == "log":
        moved = number * centre / sqrt(distribution.low * distribution.high)
    elif isinstance(distribution, Uniform):
        moved = number - 0.5 * (distribution.low + distribution.high) + centre
    else:
        moved = number - distribution.mean + centre
    return written(moved, angle=distribution.angle)


def in_words(values: Variation) -> str:
    """Write a distribution for a message or for provenance, in SI."""
    if isinstance(values, tuple):
        return " or ".join(map(str, values))
    table = values.as_table()
    if "mean" in table:
        bounds = f" in {table['from']}-{table['to']}" if {"from", "to"} <= set(table) else ""
        return f"{table['mean']} +- {table['sd']}{bounds}"
    return f"{table['from']} to {table['to']}" + (", log" if "scale" in table else "")
