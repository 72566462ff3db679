"""The package: built twice to the same bytes, and of use to somebody who has nothing but the wheel."""

import zipfile
from pathlib import Path

import pytest

from tests import dist


def test_wheel_and_sdist_are_the_same_bytes_twice_and_bring_templates_and_scenarios(tmp_path: Path) -> None:
    made = dist.build_all(tmp_path)
    assert [path.name.partition("-")[0] for path in made] == ["blocksim", "blocksim"]
    licence = (dist.ROOT / "blocksim" / "LICENSE").read_text()
    assert licence.startswith("MIT License\n\nCopyright (c) 2026 The blocksim authors\n")
    with zipfile.ZipFile(made[1]) as packed:
        names = packed.namelist()
        (metadata,) = (packed.read(name).decode() for name in names if name.endswith(".dist-info/METADATA"))
        kept = [packed.read(name).decode() for name in names if name.endswith("/LICENSE")]
    assert "\nLicense-File: blocksim/LICENSE\n" in metadata
    assert "\nLicense-Expression: MIT\n" in metadata
    assert set(kept) == {licence}
    for needed in (
        "templates/three-blocks.toml",
        "scenarios/three_blocks.toml",
        "scenarios/experiments/three_blocks.csv",
        "scenarios/records/synthetic.AT2",
        "scenarios/notebooks/three_blocks.ipynb",
    ):
        assert f"blocksim/cli/{needed}" in names
    assert [name for name in names if "__pycache__" in name or "/results/" in name] == []


@pytest.mark.long
def test_a_wheel_is_all_that_somebody_needs(tmp_path: Path) -> None:
    made = dist.build_all(tmp_path / "dist")
    (tmp_path / "somewhere").mkdir()
    dist.try_wheel(made[1], tmp_path / "somewhere")
