"""The range within which a value is looked for."""

import re
from dataclasses import dataclass
from math import ceil, exp, log, log10

from blocksim.scenario import quantities as q
from blocksim.scenario.models.variation import Uniform
from blocksim.scenario.units import parse_unit

STEPS = 1000  # as fine as this part of the prior are the values that are tried
AT_BOUND = 0.01  # of the prior's width: nearer to a bound, a value is reported to lie at it
_UNIT = re.compile(r"\s*[-+]?[0-9._]+(?:[eE][-+]?[0-9]+)?\s*(.*?)\s*", re.DOTALL)


@dataclass(frozen=True)
class Prior:
    """Bounds of a key, in `unit` (empty: plain numbers, or SI); `log`: even in the logarithm."""

    key: str
    low: float
    high: float
    unit: str = ""
    log: bool = False

    def at(self, share: float) -> float:
        """Return the number at a share (0 to 1) of the prior."""
        if not self.log:
            return self.low + share * (self.high - self.low)
        return exp(log(self.low) + share * (log(self.high) - log(self.low)))

    def value(self, number: float) -> object:
        """Return a number as a scenario takes it, rounded to what matters and never outside the bounds."""
        width = self.high - self.low
        finest = min(width, abs(number)) if self.log and number else width
        digits = ceil(log10(STEPS / finest))
        within = min(max(round(number, digits), self.low), self.high)
        return f"{within:.12g} {self.unit}" if self.unit else within

    def number(self, value: object) -> float:
        """Return the number in a value that `value` gave."""
        return float(str(value).split(" ", maxsplit=1)[0])

    def lies_at_bound(self, value: object) -> bool:
        """Return True if a value is within a hundredth of the prior's width of one of its ends."""
        ends, number = (self.low, self.high), self.number(value)
        if self.log:
            ends, number = (log(self.low), log(self.high)), log(number)
        return min(number - ends[0], ends[1] - number) <= AT_BOUND * (ends[1] - ends[0])

    def __str__(self) -> str:
        """Write the range as a person does: "0.17-0.31"."""
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.low:g} to {self.high:g}{unit}"


def prior_of(key: str, table: Uniform, written: object) -> Prior:
    """Return the prior that a distribution says; `written` is its lower end as the user wrote it, for the unit."""
    unit = unit_of(written)
    if not unit:
        return Prior(key, table.low, table.high, "rad" if table.angle else "", table.scale == "log")
    factor = float(parse_unit(unit).factor)
    low, high = (float(f"{end / factor:.12g}") for end in (table.low, table.high))
    return Prior(key, low, high, unit, table.scale == "log")


def unit_of(written: object) -> str:
    """Return the unit in a text such as "9.5 mm", empty where there is none."""
    found = _UNIT.fullmatch(written) if isinstance(written, str) else None
    return "" if found is None else found[1]


def si_number(value: object) -> float:
    """Return the SI number of a value as a scenario takes it."""
    return q.parse_quantity(value)[0] if isinstance(value, str) else float(str(value))
