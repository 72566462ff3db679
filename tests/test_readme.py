"""The pages must not promise keys, commands or files that are not there, and the first one is for ten minutes."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from blocksim.cli.app import app
from blocksim.scenario import Document
from blocksim.scenario.key_table import with_key_table

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "blocksim").rglob("*.md")),
    ROOT / "scenarios/README.md",
    ROOT / "results/README.md",
]
TEXTS = {str(page.relative_to(ROOT)): page.read_text(encoding="utf-8") for page in PAGES}


def test_the_first_page_is_short() -> None:
    assert len(README.encode()) <= 10_000


def test_the_table_of_keys_is_the_one_of_the_models() -> None:
    page = TEXTS["scenarios/README.md"]
    assert "<!-- keys" in page
    assert with_key_table(page) == page, "run: make readme"


def test_the_scenario_in_the_readme_is_valid() -> None:
    text = re.search(r"```toml\n(.*?)```", README, re.DOTALL)
    assert text is not None
    assert Document.parse(text.group(1), "README.md").build().name == "my_tower"


PLACES = sorted({(page, place) for page, text in TEXTS.items()
                 for place in re.findall(r"`((?:blocksim|tests|scenarios|results)/[a-z_/.]+)`", text)})  # fmt: skip


@pytest.mark.parametrize(("page", "place"), PLACES)
def test_every_place_that_a_page_names_exists(page: str, place: str) -> None:
    assert (ROOT / place).exists(), page


LINKS = sorted({(page, link) for page, text in TEXTS.items() for link in re.findall(r"\]\(([^)#]+)\)", text)})


@pytest.mark.parametrize(("page", "link"), LINKS)
def test_every_link_and_picture_of_a_page_is_there(page: str, link: str) -> None:
    assert (ROOT / page).parent.joinpath(link).stat().st_size > 0


def test_every_scenario_that_ships_is_described() -> None:
    page = TEXTS["scenarios/README.md"]
    assert not [path.name for path in (ROOT / "scenarios").glob("*.toml") if f"`{path.name}`" not in page]


def test_every_command_is_named_on_the_first_page() -> None:
    group = typer.main.get_command(app)
    assert not [name for name in getattr(group, "commands", {}) if name not in README]


def test_the_python_example_runs_as_a_script(tmp_path: Path) -> None:
    text = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    assert text is not None
    (tmp_path / "example.py").write_text(text.group(1), encoding="utf-8")
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    done = subprocess.run([sys.executable, "example.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert "[3 rows x" in done.stdout
