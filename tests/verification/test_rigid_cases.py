"""Every case that says something about rigid contacts, inside its tolerances; and none of them with wrong physics."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, cos, radians, sin
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from blocksim.verification import energy
from blocksim.verification.case import Case, Row, Setting, run_case
from blocksim.verification.cases import CASES, SettingError, choose_cases, exclusions
from blocksim.verification.reference import RIGID, STORE, read_store, rows_of
from blocksim.verification.scene import HEIGHT, CaseScene, Throw, Thrower
from blocksim.world import nonsmooth
from tests.verification.rocking import rocking_peaks
from tests.verification.rows import allowed, missed, same_kind

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
SETTING = Setting(scheme="nonsmooth")
APPLY = choose_cases([], SETTING)
SLOW = {"V18", "V23"}  # seconds; ledgers of tests/kernels/nonsmooth and tests/simulation are there always


@pytest.mark.parametrize(
    "case", [pytest.param(case, id=case.id, marks=pytest.mark.long if case.id in SLOW else ()) for case in APPLY]
)
def test_case_is_inside_its_tolerances_and_what_the_readme_says_with_rigid_contacts(case: Case) -> None:
    found = run_case(case, SETTING)
    assert found.rows
    assert missed(found) == []
    kept = rows_of(read_store(ROOT / STORE), RIGID, case)
    assert len(kept) == len(found.rows), "run: make verify-table"
    for old, new in zip(kept, found.rows, strict=True):
        assert same_kind(old, new)
        assert old.measured == pytest.approx(new.measured, rel=1e-9, abs=allowed(new))


def test_third_apex_of_a_drop_is_within_a_percent_at_the_default_step() -> None:
    """The table allows 4 % there; at 1 ms it was 5 % off."""
    third = run_case(next(case for case in APPLY if case.id == "V3"), SETTING).rows[2]
    assert third.quantity == "apex 3"
    assert abs(third.error) < 0.01


def peaks(width: float, height: float, restitution: float, **time: object) -> NDArray[np.float64]:
    """Return how far (rad) a block turns that is let continue one corner, each time that it turns back."""
    tilt = 0.5 * atan2(width, height)
    place = {"x": -cos(tilt) * width + sin(tilt) * height, "y": sin(tilt) * width + cos(tilt) * height}
    body = {"x": place["x"] / 2, "y": place["y"] / 2, "angle": -tilt, "width": width, "height": height}
    stepping = {"scheme": "nonsmooth", "end": 100.0, **time}
    run = CaseScene([body], restitution=restitution, ground_friction=5.0, time=stepping).start()
    found: list[float] = []
    angle, spin = float(run.bodies.angle[0]), 0.0
    while len(found) < 4:
        was, had = angle, spin
        run.to_step(run.steps + 1)
        angle, spin = float(run.bodies.angle[0]), float(run.bodies.spin[0])
        if spin * had < 0.0:  # at an impact it turns on with both spins until it is where both say
            found.append(abs(was + had * (angle - was - spin * run.step) / (had - spin)))
    return np.array(found)


@pytest.mark.parametrize(
    ("width", "height", "restitution"),
    [(0.01, 0.04, 0.5), pytest.param(0.2, 0.8, 0.5, marks=pytest.mark.long), (0.032, 0.05, 0.0), (0.05, 0.1, 0.2)],
)
def test_rocking_peaks_are_within_two_permille_at_the_default_step(
    width: float, height: float, restitution: float
) -> None:
    assert peaks(width, height, restitution) == pytest.approx(rocking_peaks(width, height, restitution), rel=2e-3)


@pytest.mark.parametrize(("width", "restitution"), [(0.032, 0.6), (0.032, 0.8), (0.0125, 0.8)])
def test_rocking_peaks_of_blocks_that_hop_are_those_of_exact_impact_times(width: float, restitution: float) -> None:
    """At 0.8 a restitution of 0.80008 would move the fourth peak of the squat block by 0.9 %."""
    exact = rocking_peaks(width, 0.05, restitution)
    assert peaks(width, 0.05, restitution) == pytest.approx(exact, rel=5e-3)


def test_what_is_about_springs_is_left_out_and_says_why() -> None:
    assert [case.id for case in CASES if case not in APPLY] == ["V2", "V20", "V25"]
    assert all(len(reason) > 20 for reason in exclusions(SETTING.scheme))
    assert exclusions("explicit") == ()
    with pytest.raises(SettingError, match=r"V20 \(.*springs"):
        choose_cases(["V1", "v20"], SETTING)


def test_settings_of_rigid_contacts_do_not_reach_scenes_of_springs() -> None:
    body = [{"y": 1.0}]
    assert Setting(rigid_step=1.0).scene(body) == Setting().scene(body)


@dataclass(frozen=True)
class Wrong(Setting):
    """A setting whose scenes have some numbers multiplied by a factor, and others replaced."""

    factor: float = 1.0
    name: str = ""
    stepping_too: tuple[tuple[str, object], ...] = ()

    def scene(self, bodies: Sequence[Mapping[str, object]], **values: Any) -> CaseScene:
        """Return the scene that is wrong."""
        time = {**values.pop("time", {}), **dict(self.stepping_too)}
        scene = super().scene(bodies, time=time, **values)
        return replace(scene, **{self.name: self.factor * getattr(scene, self.name)}) if self.name else scene


def rows_missed(wrong: Wrong, case_id: str) -> list[Row]:
    (case,) = choose_cases([case_id], SETTING)
    return missed(run_case(case, wrong))


CASES_OF = {
    ("restitution", 0.95): ("V3", "V4", "V5", "V16"),
    ("ground_friction", 1.03): ("V7", "V8", "V9", "V10", "V17"),
    ("ground_friction", 0.0): ("V12",),
    ("ground_friction", 0.01): ("V18",),
    ("friction", 1.2): ("V22",),
    ("gravity", 1.01): ("V1", "V24"),
    ("gravity", 1.03): ("V11",),
}


@pytest.mark.long  # what a case can notice changes with the case alone
@pytest.mark.parametrize(("name", "factor", "case_id"), [(*key, case) for key, ids in CASES_OF.items() for case in ids])
def test_a_wrong_number_is_noticed(name: str, factor: float, case_id: str) -> None:
    assert rows_missed(Wrong(scheme="nonsmooth", name=name, factor=factor), case_id)


def test_an_impact_that_is_not_solved_is_noticed() -> None:
    assert rows_missed(Wrong(scheme="nonsmooth", stepping_too=(("velocity_sweeps", 1),)), "V6")


def test_a_stack_on_leaning_ground_is_noticed() -> None:
    """By V13: its stacks stand within a hundredth of their limit."""

    @dataclass(frozen=True)
    class Leaning(Wrong):
        def scene(self, bodies: Sequence[Mapping[str, object]], **values: Any) -> CaseScene:
            return replace(super().scene(bodies, **values), tilt=-0.03)

    assert rows_missed(Leaning(scheme="nonsmooth"), "V13")


def test_energy_that_friction_took_and_nobody_tallied_is_noticed() -> None:
    slide = SETTING.start([{"y": HEIGHT / 2, "velocity": [0.5, 0.0]}]).to_time(0.1)
    assert slide.residual() < energy.RIGID_LEDGER_TOLERANCE
    slide.scene.contacts.tallies.friction[:] *= 0.999
    assert slide.residual() > 1e-4


def test_energy_from_rebounds_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    throws = [Throw(radians(4.0), friction, phase) for friction in (0.7, 1.0) for phase in (0.1, 0.3, 0.5, 0.7, 0.9)]
    assert energy.largest_gain(Thrower(SETTING, 1.0), throws) < energy.ROUND_OFF
    monkeypatch.setattr(nonsmooth, "has_impacts_in_rounds", lambda *_: False)  # nobody watches
    assert energy.largest_gain(Thrower(SETTING, 1.0), throws) > 1e-3
