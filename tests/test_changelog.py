"""Whoever cites a version finds in the changelog whether its results are those of another one."""

import re
from pathlib import Path

import pytest

from blocksim import __version__

CHANGELOG = (Path(__file__).parents[1] / "blocksim" / "CHANGELOG.md").read_text(encoding="utf-8")
VERSIONS = re.findall(r"^## (\S+)", CHANGELOG, flags=re.MULTILINE)
LANDINGS = re.split(r"^### ", CHANGELOG, flags=re.MULTILINE)[1:]


def test_this_version_has_a_section() -> None:
    assert __version__ in VERSIONS
    assert VERSIONS[0] in {"Unreleased", __version__}


@pytest.mark.parametrize("landing", LANDINGS, ids=lambda text: text.splitlines()[0])
def test_every_landing_says_whether_results_change(landing: str) -> None:
    assert re.search(r"^Results change: .*\*\*(yes|no)\b", landing, flags=re.MULTILINE)
