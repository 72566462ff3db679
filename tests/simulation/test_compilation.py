"""Trouble with the folder of compiled kernels has its name."""

import errno
from typing import Any

import pytest

from blocksim.errors import OutputError
from blocksim.scenario import scenario_from_mapping
from blocksim.simulation import schemes
from blocksim.simulation.schemes import SCHEMES, build_scene
from blocksim.simulation.schemes.explicit import SURFACE_OF_OUTLINES
from blocksim.simulation.schemes.nonsmooth import IN_ROUNDS, OF_OUTLINES

SETS = {name: changes for scheme in SCHEMES.values() for name, changes in scheme.kernel_sets.items()}


def test_full_disk_of_the_kernel_cache_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(schemes, "build_scene", fail)
    monkeypatch.setattr("blocksim.simulation.schemes.jit.cache_folder", lambda: "/disk/blocksim/0123")
    schemes.compile_kernels.cache_clear()
    with pytest.raises(
        OutputError, match=r"^/disk/blocksim/0123: the compiled solver cannot be stored there: No space"
    ):
        schemes.compile_kernels()


def test_blocks_with_outlines_have_sets_of_kernels_of_their_own() -> None:
    for name, plain in ((OF_OUTLINES, "nonsmooth"), (SURFACE_OF_OUTLINES, "surface")):
        changes = SETS[name]
        without = {key: value for key, value in changes.items() if key != "blocks"}
        outlined = scenario_from_mapping({**schemes.SMALLEST_SCENE, **changes})
        rectangular = scenario_from_mapping({**schemes.SMALLEST_SCENE, **without})
        assert schemes.kernels_of(outlined) == name
        assert schemes.kernels_of(rectangular) == plain


@pytest.mark.parametrize(
    "change",
    [
        *SETS.values(),
        {"time": {"scheme": "nonsmooth"}, "pairs": {"any": {"ground": {"restitution": 0.9}}}},
    ],
)
def test_scenes_without_impacts_in_rounds_have_kernels_without_them(change: dict[str, Any]) -> None:
    scenario = scenario_from_mapping({**schemes.SMALLEST_SCENE, **change})
    scene: Any = build_scene(scenario)
    in_rounds = hasattr(scene, "kept") and scene.contacts.impact_lanes is not None
    assert in_rounds == (schemes.kernels_of(scenario) in IN_ROUNDS.values())
