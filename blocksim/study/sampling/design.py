"""The values of all cases of a sweep, each made when it is asked for."""

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import overload

from blocksim.scenario.models.variation import Variation

Settings = dict[str, object]
"""Dotted key and value of everything that one case sets."""


@dataclass(frozen=True)
class Design(Sequence[Settings]):
    """A sequence of settings made from one column of values a key."""

    columns: Mapping[str, Sequence[object]]

    @abstractmethod
    def __len__(self) -> int:
        """Return the number of cases."""

    @abstractmethod
    def row(self, number: int) -> Settings:
        """Return the settings of a case, 0 <= number < len."""

    @overload
    def __getitem__(self, number: int) -> Settings: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[Settings]: ...
    def __getitem__(self, number: int | slice) -> Settings | Sequence[Settings]:
        if isinstance(number, slice):
            return [self.row(index) for index in range(len(self))[number]]
        return self.row(range(len(self))[number])


class Together(Design):
    """The k-th case has the k-th value of every key; all columns are equally long."""

    def __len__(self) -> int:
        """Return the length of any column."""
        return len(next(iter(self.columns.values())))

    def row(self, number: int) -> Settings:
        """Return the values of one row."""
        return {key: column[number] for key, column in self.columns.items()}


class Combinations(Design):
    """Every value of every key with all values of the others; the last key changes fastest."""

    def __len__(self) -> int:
        """Return the product of the lengths."""
        return math.prod(len(column) for column in self.columns.values())

    def row(self, number: int) -> Settings:
        """Return one combination, from the digits of its number."""
        settings: Settings = {}
        for key, column in reversed(list(self.columns.items())):
            number, place = divmod(number, len(column))
            settings[key] = column[place]
        return {key: settings[key] for key in self.columns}


def levels_of(values: Variation) -> tuple[object, ...]:
    """Return the values of a list; a distribution, which no mode without samples accepts, has none to list."""
    return values if isinstance(values, tuple) else ()
