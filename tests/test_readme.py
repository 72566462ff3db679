"""The README must not promise keys, commands or files that are not there."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from blocksim.scenario import Document
from blocksim.scenario.reference import with_key_table

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_the_table_of_keys_is_the_one_of_the_models() -> None:
    assert with_key_table(README) == README, "run: make readme"


def test_the_scenario_in_the_readme_is_valid() -> None:
    text = re.search(r"```toml\n(.*?)```", README, re.DOTALL)
    assert text is not None
    assert Document.parse(text.group(1), "README.md").build().name == "my_tower"


PLACES = sorted(set(re.findall(r"`((?:blocksim|tests|scenarios|results)/[a-z_/.]+)`", README)))


@pytest.mark.parametrize("place", PLACES)
def test_every_place_that_the_readme_names_exists(place: str) -> None:
    assert (ROOT / place).exists()


def test_the_picture_of_the_readme_is_there() -> None:
    assert (ROOT / "results" / "three_blocks.png").stat().st_size > 0


def test_the_python_example_runs_as_a_script(tmp_path: Path) -> None:
    text = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    assert text is not None
    (tmp_path / "example.py").write_text(text.group(1), encoding="utf-8")
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    done = subprocess.run([sys.executable, "example.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "[3 rows x" in done.stdout
