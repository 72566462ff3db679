"""Formats by name."""

import pytest

from blocksim.errors import InvalidInputError
from blocksim.simulation.stores.exports import FORMATS, find_format


def test_formats_are_found_and_misspelt_ones_told() -> None:
    assert [find_format(name) for name in FORMATS] == list(FORMATS.values())
    with pytest.raises(
        InvalidInputError, match="--format vtkhfd: unsupported format; use csv or vtkhdf or geojson or dxf"
    ):
        find_format("vtkhfd")
