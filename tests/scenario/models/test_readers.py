"""What fields of a scenario take: words that are available, whole numbers in their range."""

import numpy as np
import pytest
from pydantic_core import PydanticCustomError

from blocksim.scenario.geometry import edge_distance
from blocksim.scenario.models.base import OneOf, Whole
from blocksim.scenario.models.timeline import NewVelocity


@pytest.mark.parametrize("value", [True, 1.0, "2", 0, 6])
def test_whole_number_is_no_flag_and_in_its_range(value: object) -> None:
    with pytest.raises(PydanticCustomError, match="is not a whole number from 1 to 5"):
        Whole(1, 5).read(value)
    assert [Whole(1, 5).read(one) for one in (1, 5)] == [1, 5]


@pytest.mark.parametrize("value", ["spheres", 2, 1.0, True])
def test_word_is_one_of_those_that_are_available(value: object) -> None:
    with pytest.raises(PydanticCustomError, match="is unknown"):
        OneOf(("discs", 1)).read(value)


def test_distance_from_an_edge_is_that_from_its_end_beyond_it() -> None:
    square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    assert edge_distance(np.array([[3.0, 0.5], [0.5, 0.25], [4.0, 5.0]]), square) == pytest.approx([2.0, 0.25, 5.0])


@pytest.mark.parametrize("key", ["vx", "vy", "spin"])
def test_velocity_of_an_event_may_be_one_component_alone(key: str) -> None:
    assert getattr(NewVelocity.model_validate({"body": "1", key: 0.5}), key) == 0.5
