"""The way of a scenario to final.csv, as blocksim/README.md tells it, is the one that a run takes."""

import re
import sys
import threading
from importlib import import_module
from pathlib import Path
from types import FrameType

import pytest
from typer.testing import CliRunner

import blocksim
from blocksim.cli.commands import app

PACKAGE = Path(blocksim.__file__).parent
MOST = 20  # modules of the way outside kernels
OF_SCHEMES = {"explicit": "kernels/explicit/step.py", "nonsmooth": "kernels/nonsmooth/step.py"}
ONLY_RIGID = {"world/nonsmooth.py", "world/rigid_step.py", OF_SCHEMES["nonsmooth"]}
ONLY_SPRINGS = {OF_SCHEMES["explicit"], "world/step.py"}


def modules_named() -> list[str]:
    """Return the modules of the way, in the order of the table."""
    text = (PACKAGE / "README.md").read_text(encoding="utf-8")
    table = text.split("## From the scenario to final.csv")[1].split("\n\n", 3)[2]
    cells = [line.split("|")[1] for line in table.splitlines() if line.startswith("| [")]
    return list(dict.fromkeys(path for cell in cells for path in re.findall(r"\(([\w/]+\.py)\)", cell)))


def modules_called(arguments: list[str]) -> list[str]:
    """Return the modules of the package in the order in which a command first calls a function of theirs."""
    called: dict[str, None] = {}

    def see(frame: FrameType, event: str, _: object) -> None:
        path = Path(frame.f_code.co_filename)
        if event == "call" and frame.f_code.co_name != "<module>" and path.is_relative_to(PACKAGE):
            called.setdefault(path.relative_to(PACKAGE).as_posix())

    sys.setprofile(see)
    threading.setprofile(see)
    try:
        result = CliRunner().invoke(app, arguments)
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    assert result.exit_code in {0, 1}, result.output
    return list(called)


@pytest.mark.parametrize(("scheme", "missing"), [("explicit", ONLY_RIGID), ("nonsmooth", ONLY_SPRINGS)])
def test_a_run_passes_through_the_modules_of_the_page_in_their_order(
    scheme: str, missing: set[str], tmp_path: Path
) -> None:
    scenario = PACKAGE.parent / "scenarios" / "three_blocks_nominal.toml"
    settings = ["--set", f"time.scheme={scheme}", "--set", "time.end=0.01"]
    run = ["run", str(scenario), *settings, "--quiet", "--out"]
    assert CliRunner().invoke(app, [*run, str(tmp_path / "first")]).exit_code in {0, 1}  # modules call some at import
    called = modules_called([*run, str(tmp_path / "run")])
    way = [name for name in modules_named() if name not in missing]
    assert set(way) <= set(called), sorted(set(way) - set(called))
    places = [called.index(name) for name in way]
    assert places == sorted(places), "called in the order " + ", ".join(sorted(way, key=called.index))


def test_the_way_is_short() -> None:
    assert len([name for name in modules_named() if not name.startswith("kernels/")]) <= MOST


def places_named() -> list[tuple[str, str]]:
    """Return the modules, and after each line's modules its functions, of the table of places."""
    text = (PACKAGE / "README.md").read_text(encoding="utf-8").split("## Where is …")[1]
    lines = [line.split("|")[2:4] for line in text.split("\n\n")[1].splitlines()[2:]]
    return [
        (path, name)
        for modules, names in lines
        for path, name in zip(re.findall(r"\(([\w/]+\.py)\)", modules), re.findall(r"`(\w+)`", names), strict=False)
    ]


@pytest.mark.parametrize(("path", "name"), places_named())
def test_what_the_page_says_where_it_is_is_there(path: str, name: str) -> None:
    module = import_module(f"blocksim.{path.removesuffix('.py').replace('/', '.')}")
    assert getattr(module, name).__module__ == module.__name__
