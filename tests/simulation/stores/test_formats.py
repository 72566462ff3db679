"""Formats by name."""

import pytest

from blocksim.errors import InvalidInputError
from blocksim.simulation.stores.exports import FORMATS, format_named


def test_formats_are_found_and_misspelt_ones_told() -> None:
    assert [format_named(name) for name in FORMATS] == list(FORMATS.values())
    with pytest.raises(
        InvalidInputError, match="--format vtkhfd: unsupported format; use csv or vtkhdf or geojson or dxf"
    ):
        format_named("vtkhfd")
