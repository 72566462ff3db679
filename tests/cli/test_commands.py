"""Command lines, right and wrong: exit code, what is printed, and the files that are written."""

import shlex
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import SCENARIOS, Command
from tests.golden import Golden

FIT = "calibrate slide.toml --experiment measured.csv --fit friction.block_ground=0.2:0.5"
SCATTER = "--scatter 'bodies.0.velocity.0=0.5 m/s+-0.01 m/s'"
JUDGED = "compare swept --experiment measured.csv"
MORRIS = "sensitivity scenarios/slide.toml --vary friction.block_ground=0.3:0.4"
FRAGILE = "fragility scenarios/slide.toml --scatter friction.block_ground=0.3:0.4"
SAMPLED = "sweep scenarios/slide.toml --vary friction.block_ground=0.3:0.4"
LINES = [line for line in Path(__file__).with_name("commands.txt").read_text().splitlines() if line and line[0] != "#"]

SWEPT = "case,status,reason,block.x_mm\n1,finished,,42.0\n2,finished,,43.5\n"
MEASURED = "block,quantity,unit,replicate,value\nblock,x,mm,1,41\nblock,x,mm,2,43\n"


@pytest.fixture
def place(blocksim: Command, made_up_run: Path, finished_sweep: Path, tmp_path: Path) -> Path:
    """Give a folder with a run, a sweep, tables, broken scenarios and files of other people."""
    slide = (SCENARIOS / "slide.toml").read_text()
    texts = {
        "slide.toml": slide,
        "big.toml": slide.replace("[time]\n", '[time]\nstep = "1 ms"\n'),
        "thin.toml": slide.replace("[contact]\n", '[contact]\nskin = "5 um"\n'),
        "bad.toml": "schema = 2\n",
        "measured.csv": MEASURED,
        "swept/sweep.csv": SWEPT,
        "indices.csv": "output,unit,key,mu*,±,mu,sigma\nx of block 2,mm,gravity,5,1,-5,0\n",
        "broken/sweep.csv": "a,b\n1,2\n",
        "empty/run.h5": "",
        "foreign/thesis.tex": "years of work",
        **{f"mine.{ending}": "years of work" for ending in ("json", "png", "csv", "pdf", "html", "gif")},
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "run").symlink_to(made_up_run)
    (tmp_path / "sweep").symlink_to(finished_sweep)
    assert blocksim("--version").code == 0
    return tmp_path


def contents(folder: Path) -> dict[Path, bytes | None]:
    """Return what is in a folder."""
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


@pytest.mark.parametrize("line", LINES, ids=str)
def test_commands(blocksim: Command, place: Path, golden: Golden, line: str) -> None:
    before = contents(place)
    answer = blocksim(*shlex.split(line))
    assert max(map(len, answer.out.splitlines()), default=0) <= 80
    after = contents(place)
    files = sorted(str(path.relative_to(place)) for path, content in after.items() if content is not None)
    written = [f"writes {name}\n" for name in files if after[place / name] != before.get(place / name)]
    assert before.keys() <= after.keys()
    golden(f"exit code {answer.code}\n{answer.out}{answer.err}{''.join(written)}", rules=["sizes"])


NEEDED = {
    "ffmpeg of animate": ("imageio_ffmpeg", "animate run --out film.mp4"),
    "optuna of calibrate": ("optuna", f"{FIT} {SCATTER}"),
    "scipy of calibrate": ("scipy.stats", f"{FIT} {SCATTER}"),
    "scipy of compare": ("scipy.special", JUDGED),
    "scipy of fragility": ("scipy.special", f"{FRAGILE} --intensity gravity=1,2 --out out"),
    "scipy of a sweep": ("scipy.stats", f"{SAMPLED} --mode lhs --samples 4 --out out"),
    "SALib of sensitivity": ("SALib", MORRIS),
    "SALib of sensitivity by Sobol": ("SALib", f"{MORRIS} --method sobol"),
}


@pytest.mark.parametrize(("package", "line"), NEEDED.values(), ids=NEEDED)
def test_missing_packages(
    blocksim: Command, golden: Golden, monkeypatch: pytest.MonkeyPatch, place: Path, package: str, line: str
) -> None:
    before = contents(place)
    for name in [name for name in sys.modules if f"{name}.".startswith(f"{package}.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setenv("PATH", "")
    answer = blocksim(*shlex.split(line))
    assert (answer.code, answer.out) == (69, "")
    assert contents(place) == before
    golden(answer.err)
