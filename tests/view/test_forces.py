"""Arrows of contact forces: where, how long, on which block, and what is reported of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.simulation.trajectory import CONTACT_ROW, Contacts
from blocksim.view.animation import Look, Pace, draw_animation
from blocksim.view.arrows import force_scale
from blocksim.view.kinds import RUN_KINDS
from blocksim.view.scene import PictureOptions
from tests.view.made_up import pressed, toppling


def test_scale_is_that_of_usual_forces_not_of_impacts() -> None:
    frames = pressed(toppling(3))
    scale = force_scale(frames)
    assert frames.contacts is not None
    frames.contacts.rows["normal_force"][:5] = 1e6
    assert force_scale(frames).mm_per_newton == pytest.approx(scale.mm_per_newton, rel=0.1)
    assert scale.longest == pytest.approx(2.0 * 0.6 * 41.0)
    assert "5 N is 20.4 mm long, capped at 12.1 N" in scale.explanation


@pytest.mark.parametrize("kind", [kind for kind in RUN_KINDS if kind != "profile"])  # draws soil, without forces
def test_missing_contacts_are_reported_with_what_to_do(tmp_path: Path, kind: str) -> None:
    with pytest.raises(InvalidInputError, match=r"stored no contacts.* --set output\.contacts=true"):
        RUN_KINDS[kind](toppling(3), tmp_path / "picture.png", PictureOptions(forces=True))
    assert list(tmp_path.iterdir()) == []


def test_animation_with_forces_differs_and_one_of_a_run_without_is_refused(tmp_path: Path) -> None:
    frames, pace = pressed(toppling(2, steps=4)), Pace(1.0, 5.0)
    draw_animation(frames, tmp_path / "with.gif", pace, Look(240, forces=True))
    draw_animation(frames, tmp_path / "without.gif", pace, Look(240))
    assert (tmp_path / "with.gif").read_bytes() != (tmp_path / "without.gif").read_bytes()
    with pytest.raises(InvalidInputError, match="stored no contacts"):
        draw_animation(toppling(2), tmp_path / "none.gif", pace, Look(240, forces=True))
    assert not (tmp_path / "none.gif").exists()


def test_run_without_a_single_contact_has_a_scale() -> None:
    frames = replace(toppling(1, steps=3), contacts=Contacts(np.zeros(3, dtype=np.int64), np.zeros(0, CONTACT_ROW)))
    assert force_scale(frames).mm_per_newton > 0.0
