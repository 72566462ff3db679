"""Rigid contacts without the compiler."""

from collections.abc import Iterator

import numpy as np
import pytest


@pytest.fixture(autouse=True)
def division() -> Iterator[None]:
    """Divide as compiled code does, which computes all cases, IEEE 754's infinities among them, and then takes one.

    The two points of a contact coincide at an edge: then the case of both is 1/0, and one of the others is taken.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        yield
