"""Arrows of contact forces and of loads, and pictures of probes: how long, which way, and what is reported of them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from blocksim.errors import InvalidInputError
from blocksim.scenario import Model
from blocksim.simulation import instruments, simulate_into
from blocksim.simulation.trajectory import CONTACT_ROW, Contacts, Frames
from blocksim.view import run_data
from blocksim.view.arrows import FORCE, Actions, actions_on, force_scale
from blocksim.view.kinds import RUN_KINDS
from blocksim.view.report.page import page_text
from blocksim.view.report.subjects import read_folder, run_subject
from blocksim.view.scene import PictureOptions
from blocksim.view.time_panels import draw_probes, panels_of, probe_picture
from tests.golden import Golden
from tests.simulation.test_actuators import pushed
from tests.simulation.test_probes import scene
from tests.view.drawings import COEFFICIENTS, END, FORCES, acting, slab
from tests.view.made_up import pressed, toppling
from tests.view.study_drawings import probe

PUSH = FORCES[0]
RISING = {**PUSH, "history": {"kind": "ramp", "end": 4.0}}


def test_scale_is_that_of_usual_forces_not_of_impacts_and_there_is_one_without_contacts() -> None:
    frames = pressed(toppling(3))
    scale = force_scale(frames)
    assert frames.contacts is not None
    frames.contacts.rows["normal_force"][:5] = 1e6
    assert force_scale(frames).mm_per_newton == pytest.approx(scale.mm_per_newton, rel=0.1)
    assert scale.longest == pytest.approx(2.0 * 0.6 * 41.0)
    assert "5 N is 20.4 mm long, capped at 12.1 N" in scale.explanation
    none = Contacts(np.zeros(3, dtype=np.int64), np.zeros(0, CONTACT_ROW))
    assert force_scale(replace(toppling(1, steps=3), contacts=none)).mm_per_newton > 0.0


@pytest.mark.parametrize("kind", [kind for kind in RUN_KINDS if kind != "profile"])  # draws soil, without forces
def test_missing_contacts_are_reported_with_what_to_do(tmp_path: Path, kind: str) -> None:
    with pytest.raises(InvalidInputError, match=r"stored no contacts.* --set output\.contacts=true"):
        RUN_KINDS[kind](toppling(3), tmp_path / "picture.png", PictureOptions(forces=True))
    assert list(tmp_path.iterdir()) == []


def actions(loads: Sequence[Mapping[str, object]], frames: Frames, **tables: Any) -> Actions:
    """Return what acts in all frames of one block."""
    return actions_on(frames, np.arange(len(frames.time)), acting(loads, **tables))


def test_loads_follow_their_histories_and_are_gone_when_an_event_ends_them_or_their_body_is_removed() -> None:
    frames = slab([0.0] * 6)
    gone = slab([0.0] * 6)
    gone.vx[2:] = np.nan
    for load, seen, tables, expected in (
        (RISING, frames, {}, [0.0, 0.25, 0.5, 0.75, 1.0, 1.0]),
        (RISING, frames, {"events": END}, [0.0, 0.5, 1.0, 0.0, 0.0, 0.0]),
        (PUSH, gone, {}, [1.0, 1.0, 0.0, 0.0, 0.0, 0.0]),
    ):
        (force,) = (one for one in actions([load], seen, **tables).arrows if one.kind == FORCE)
        assert force.way[:, 0, 0] == pytest.approx(expected)


def test_marks_show_where_gravity_points_in_the_picture() -> None:
    first, last = actions(COEFFICIENTS, slab([0.0, 0.0])).marks
    assert first[0].way == (-1.0, 0.0)
    assert first[1].way == pytest.approx((0.0, -1.0))
    assert last[1].way == pytest.approx((-0.5, -np.sqrt(0.75)))
    table = {"kind": "gravity", "to": "60 deg", "rate": "30 deg/s"}
    tilted = actions([table], slab([0.0, 0.0]), ground={"tilt": "30 deg"}).marks
    assert tilted[0][0].way == pytest.approx((0.0, -1.0))  # such a picture is turned


def test_a_moving_support_is_taken_off_the_motion_of_a_point() -> None:
    still = probe("point")
    still.columns["relative_dx"][:], still.columns["relative_dy"][:] = still["dx"], still["dy"]
    assert [*panels_of(still)[0].lines] == ["dx", "dy"]
    assert [*panels_of(probe("point"))[0].lines] == ["relative dx", "relative dy"]


@pytest.mark.parametrize("kind", instruments.COLUMNS)
def test_every_kind_of_probe_has_a_picture(kind: str) -> None:
    assert all(len(panel.lines) > 0 for panel in panels_of(probe(kind)))
    assert probe_picture(probe(kind)).startswith(b"\x89PNG")


def test_an_actuator_pushes_as_its_record_says() -> None:
    """Its arrow in pictures, between two samples."""
    scenario, record = pushed("nonsmooth"), probe("actuator")
    (jack,) = run_data.support_of(Model(scenario), (), {"jack": record}).loads
    assert jack.values(np.array([0.15])) == pytest.approx(0.5 * (record["force"][1] + record["force"][2]))
    assert run_data.support_of(Model(scenario)).loads == ()


def test_what_cannot_be_drawn_is_told(golden: Golden) -> None:
    many, said = {f"p{k}": probe("point") for k in range(5)}, []
    for probes, names in (({}, ()), ({"a": probe("joint", 0)}, ()), ({"base": probe("force")}, ("bass",)), (many, ())):
        with pytest.raises(InvalidInputError) as caught:
            draw_probes(probes, Path("p.png"), names=names)
        said.append(str(caught.value))
    golden("\n".join(said))


def test_a_report_shows_the_probes_of_a_run(tmp_path: Path) -> None:
    probes = [{"kind": "force", "on": "supports", "name": "base"}]
    simulate_into(scene("nonsmooth", probes, 0.02), tmp_path / "run")
    stored = read_folder(tmp_path / "run")
    text = page_text([run_subject("a", stored)])
    assert "base: force, 3 samples to 0.02 s, in probe-base.csv" in text
    assert 'src="data:image/png;base64,iVBOR' in text
    assert np.isfinite(stored.probes["base"]["fy"]).all()
