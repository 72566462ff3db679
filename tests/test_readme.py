"""The pages must not promise keys, commands or files that are not there, and the first one is for ten minutes."""

import re
import runpy
from pathlib import Path

import pytest
import typer

from blocksim import __version__
from blocksim.cli.commands import app
from blocksim.scenario import Document
from tests.key_table import BEGIN, END, key_table
from tests.verification.reference import with_part

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [
    ROOT / "README.md",
    *sorted((ROOT / "blocksim").rglob("*.md")),
    ROOT / "scenarios/README.md",
    ROOT / "results/README.md",
    ROOT / "results/software_paper.md",
    ROOT / "tests/README.md",
    ROOT / ".github/CONTRIBUTING.md",
]
# Phrases that readers stumbled over, as quoted by them; pages, help, templates and messages have better ones.
STUMBLING = (
    "compare the bits", "what it comes to", "throws away", "energy off by", "from its least", "no film format",
    "is no kind of", "there is: steel", "turns of the blocks", "do not vary", "does the others", "asked for:",
    "inside in everything", "one more test", "as if nothing came", "from anywhere", "ways of the centres",
    "finds the same", "members of a sweep", "by hand at most", "all the same", "or mend", "developers' tools",
    "lies along x, height", "tilt rises", "makes it fall", "put soil behind", "needs its unit",
    "mistakes are reported together", "that folder, the folder",
    "at which the structure falls", "if anything is outside", "cannot give the",
    "is within reach", "unprinted values", "are printed, interlocks", "µm can decide", "Where to read on",
    "by how much results change", "show where the blocks end", "as far as it came", "far off leave", "blocks fly",
    "over its value", "drawn for every member", "random members", "blocks move on", "goes by the distance",
    "last lines say how", "decide where the blocks", "never replaced", "takes up again", "first moved:",
    "grows with the square", "take turns;", "comes at once would", "aluminium's own: faster", "unit that is meant",
)  # fmt: skip
TEXTS = {str(page.relative_to(ROOT)): page.read_text(encoding="utf-8") for page in PAGES}


def test_the_first_page_is_short() -> None:
    assert len(README.encode()) <= 10_000


def test_no_text_for_users_has_a_phrase_that_readers_stumbled_over() -> None:
    sources = [
        *PAGES,
        *(ROOT / ".docs").rglob("*.md"),
        *(ROOT / "blocksim/cli").rglob("*.toml"),
        *(ROOT / "blocksim/cli").rglob("*.py"),
    ]
    sources += [*(ROOT / "blocksim/study").glob("*.py"), *(ROOT / "blocksim/scenario").glob("*.py")]
    found = [
        (str(path.relative_to(ROOT)), phrase)
        for path in sources
        if path.name != "CHANGELOG.md"
        for text in [" ".join(path.read_text(encoding="utf-8").split())]
        for phrase in STUMBLING
        if phrase in text
    ]
    assert found == []


def test_the_table_of_keys_is_the_one_of_the_models() -> None:
    page = TEXTS["scenarios/README.md"]
    assert "<!-- keys" in page
    assert with_part(page, BEGIN, key_table(), END) == page, "run: make readme"


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


def test_the_pages_lead_to_the_reproduction_of_the_paper_and_to_the_targets_that_make_pictures() -> None:
    for page, link in (("README.md", "results/paper/README.md"), ("results/README.md", "paper/README.md")):
        assert f"]({link})" in TEXTS[page]
        assert {"`make paper`", "`make demo`"} <= set(re.findall(r"`make [a-z]+`", TEXTS[page]))
    assert "`make help`" in README
    targets = re.findall(r"^([a-z-]+):.*## ", (ROOT / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert {"help", "demo", "paper"} <= set(targets)


def test_every_command_is_named_on_the_first_page() -> None:
    group = typer.main.get_command(app)
    assert not [name for name in getattr(group, "commands", {}) if name not in README]


def test_the_python_example_runs_as_a_script(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    text = re.search(r"```python\n(.*?)```", README, re.DOTALL)
    assert text is not None
    (tmp_path / "example.py").write_text(text.group(1), encoding="utf-8")
    (tmp_path / "scenarios").symlink_to(ROOT / "scenarios")
    monkeypatch.chdir(tmp_path)
    runpy.run_path("example.py", run_name="__main__")
    out, err = capfd.readouterr()
    assert err == ""
    assert "[3 rows x" in out


CHANGELOG = (Path(__file__).parents[1] / "blocksim" / "CHANGELOG.md").read_text(encoding="utf-8")
VERSIONS = re.findall(r"^## (\S+)", CHANGELOG, flags=re.MULTILINE)
LANDINGS = re.split(r"^### ", CHANGELOG, flags=re.MULTILINE)[1:]


def test_this_version_has_a_section() -> None:
    assert __version__ in VERSIONS
    assert VERSIONS[0] in {"Unreleased", __version__}


@pytest.mark.parametrize("landing", LANDINGS, ids=lambda text: text.splitlines()[0])
def test_every_landing_says_whether_results_change(landing: str) -> None:
    assert re.search(r"^Results change: .*\*\*(yes|no)\b", landing, flags=re.MULTILINE)
