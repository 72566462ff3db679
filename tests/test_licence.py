"""The licence comes with the sources and with every package that is built of them."""

import zipfile
from pathlib import Path

from hatchling.builders.wheel import WheelBuilder

ROOT = Path(__file__).parents[1]


def test_wheel_holds_the_licence_and_names_it(tmp_path: Path) -> None:
    licence = (ROOT / "blocksim" / "LICENSE").read_text()
    assert licence.startswith("MIT License\n\nCopyright (c) 2026 The blocksim authors\n")
    (wheel,) = WheelBuilder(str(ROOT)).build(directory=str(tmp_path), versions=["standard"])
    with zipfile.ZipFile(wheel) as packed:
        names = packed.namelist()
        (metadata,) = (packed.read(name).decode() for name in names if name.endswith(".dist-info/METADATA"))
        kept = [packed.read(name).decode() for name in names if name.endswith("/LICENSE")]
    assert "\nLicense-File: blocksim/LICENSE\n" in metadata
    assert "\nLicense-Expression: MIT\n" in metadata
    assert kept
    assert set(kept) == {licence}
