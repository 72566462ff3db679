"""Histories: what is drawn over time, of how many blocks, in which units and colours."""

from pathlib import Path

import pytest

from blocksim.errors import InvalidInputError
from blocksim.view.history import draw_history
from blocksim.view.paints import by_speed
from blocksim.view.scene import PictureOptions
from tests.golden import Golden
from tests.view.made_up import toppling


def test_long_runs_are_thinned_and_many_grey_lines_stored_as_an_image(tmp_path: Path) -> None:
    draw_history(toppling(200, steps=3000), tmp_path / "history.svg")
    assert (tmp_path / "history.svg").stat().st_size < 2_000_000


@pytest.mark.parametrize(
    "options",
    [
        PictureOptions(panels=("speeed",)),
        PictureOptions(blocks=("9",)),
        PictureOptions(panels=("force",)),
        PictureOptions(paint=by_speed(toppling(3))),
    ],
    ids=["panel", "block", "contacts", "speed"],
)
def test_what_a_run_does_not_have_or_lines_cannot_show_is_refused(golden: Golden, options: PictureOptions) -> None:
    with pytest.raises(InvalidInputError) as caught:
        draw_history(toppling(3), "history.png", options)
    golden(str(caught.value))
