"""Command lines that cannot be right: exit code and message in full; nothing is written, changed or left behind."""

import shlex
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import SCENARIOS, Command
from tests.golden import Golden

NOMINAL = "scenarios/three_blocks_nominal.toml"
FIT = "calibrate slide.toml --experiment measured.csv --fit friction.block_ground=0.2:0.5"
SCATTER = "--scatter 'bodies.0.velocity.0=0.5 m/s+-0.01 m/s'"
SWEEP = "sweep scenarios/three_blocks_nonsmooth.toml --set time.end=0.01 --out out"
KINETIC = "friction.block_block.kinetic"
VARIED = f"{SWEEP} --vary {KINETIC}=0.1,0.2"
SENSITIVITY = "sensitivity scenarios/slide.toml"
MORRIS = f"{SENSITIVITY} --vary friction.block_ground=0.3:0.4"
JUDGED = "compare swept --experiment measured.csv"

LINES = f"""
rnu
run
run a.toml --outt x
compare
compare a --threshold 2
sweep
sweep a.toml --mode gird
sweep a.toml --jobs 0
schema x
run scenarios/slide.toml --set ground.tilt=10 deg
run scenarios/slide.toml other.toml
animate run --out film.avi
animate run --out nix/film.gif --speed 1 --fps 10 --width 240
animate run --speed 0.00001
animate run --fps 60
animate run --speed 0
animate run --width 3
bench trheads
bench walls --dpi 80
bench --out nix/bench.json
bench --out scenarios
bench --out mine.json
calibrate slide.toml --experiment measured.csv {SCATTER}
calibrate scenarios/slide.toml --fit friction.block_ground=0.2:0.5 {SCATTER}
calibrate slide.toml --experiment measured.csv --fit friction.block_gruond=0.2:0.5
calibrate slide.toml --experiment measured.csv --fit 'friction.block_ground=0.2 mm:0.5 mm'
calibrate slide.toml --experiment measured.csv --fit friction.block_ground=0.5:0.2
calibrate slide.toml --experiment measured.csv --fit friction.block_ground=0.2
calibrate slide.toml --experiment measured.csv --fit friction.block_ground=0.2+-0.1
calibrate slide.toml --experiment measured.csv --fit friction.block_ground
{FIT}
{FIT} --fit friction.block_ground=0.2:0.5
{FIT} --fit friction.block_ground.kinetic=0.1:0.2
{FIT} --scatter friction.block_ground.static=0.3:0.4
{FIT} --scatter friction.block_ground=0.3,0.4
{FIT} --scatter 'bodies.0.velocity.0=0.5 mm+-0.1 mm'
{FIT} {SCATTER} --experiment missing.csv
{FIT} {SCATTER} --out .
{FIT} {SCATTER} --trials 0
check scenarios/tower.toml --set time.scheme=nonsmooth --set 'time.step=20 ms'
check {NOMINAL} --set materials.aluminium.young_modulus=1e30 --set contact.stiffness_scale=1
check {NOMINAL} --set time.end=1e30
check {NOMINAL} --set time.step=1e-18
check {NOMINAL} --set contact.stiffness_scale=1e30
check {NOMINAL} --set time.safety=1e-18
check big.toml
check thin.toml --set contact.stiffness_scale=3e-4
compare nix
compare empty
compare scenarios/tower.toml
compare scenarios/experiments/three_blocks.csv
compare run --experiment nix.csv
compare run --experiment scenarios/tower.toml
compare swept
{JUDGED} --threshold nan
{JUDGED} --threshold -1
{JUDGED} --threshold inf
{JUDGED} --u-num nan
{JUDGED} --u-num -1
{JUDGED} --u-num inf
converge scenarios/slide.toml --study spacing
converge scenarios/slide.toml --study speed
converge scenarios/slide.toml --levels 1
converge scenarios/slide.toml --tolerance 0
converge scenarios/slide.toml --out levels.bmp
converge scenarios/slide.toml --out mine.png
converge scenarios/slide.toml --study step --size 20x20mm
converge scenarios/slide.toml --set 'time.step=1 s'
converge scenarios/slide.toml --set time.stap=1
export run --format xlsx
export run --out nix/frames.csv
export run --out mine.csv
export run --out run/final.csv
new stak mine
new xyz mine
new stack 'a b'
new stack .toml
new stack no/where
new stack big.toml
plot run --out strip.bmp
plot run --out nix/strip.png
plot run --out mine.pdf
plot run --forces
plot run --times 0,x
plot run --times 0,99
plot run --at '5 furlongs'
plot run --size '10 by 20'
plot run --size 5x3000mm
plot run --size 40x30mm
plot run --size 2000x2000mm --dpi 300
plot run --colour mood
plot run --block ,
plot run --block 1
plot run --experiment nix.csv
plot run --kind finel
plot run --kind final --frames 4
plot run --kind history --block 7
plot run --kind history --at 0
plot run --kind history --colour speed
report nix
report empty
report broken
report run --experiment nix.csv
report run --out nix/report.html
report run --out mine.html
run nix.toml
run scenarios
run bad.toml
run {NOMINAL} --set friction.block_blok=1
run {NOMINAL} --set time.step=1e-3
run {NOMINAL} --set experiment.table=nix.csv
run {NOMINAL} --set experiment.table=../tests/bad.csv
run {NOMINAL} --out bad.toml
run {NOMINAL} --out bad.toml/x
run {NOMINAL} --out foreign
run {NOMINAL} --out foreign --overwrite
run {NOMINAL} --threads 0
run {NOMINAL} --resume --overwrite
run {NOMINAL} --wall-time 3
run {NOMINAL} --wall-time '0 s'
run {NOMINAL} --checkpoint-time '3 mm'
run {NOMINAL} --checkpoint-every soon
run {NOMINAL} --checkpoint-steps 0
{SENSITIVITY}
{SENSITIVITY} --vary friction.block_gruond=0.3:0.4
{SENSITIVITY} --vary friction.block_ground=0.4:0.3
{SENSITIVITY} --vary 'bodies.0.velocity.0=1 mm:2 mm'
{SENSITIVITY} --vary friction.block_ground=0.3:0.4:5
{MORRIS} --samples 1
{MORRIS} --method fast
{MORRIS} --out scenarios
{MORRIS} --out nowhere/indices.csv
{MORRIS} --out mine.csv
{SWEEP}
{SWEEP} --vary friction.block_blok=1,2
{SWEEP} --vary {KINETIC}
{SWEEP} --vary =1,2
{SWEEP} --vary {KINETIC}=
{SWEEP} --vary {KINETIC}=,
{SWEEP} --vary {KINETIC}=0.1:x:3
{SWEEP} --vary {KINETIC}=0.1:0.2:0
{SWEEP} --vary {KINETIC}=0.1:0.2:2.5
{SWEEP} --vary {KINETIC}=[0.1
{SWEEP} --vary {KINETIC}=0.8,0.9
{SWEEP} --vary {KINETIC}=0.1:0.3
{SWEEP} --vary 'friction.block_block.transition_speed=5 mm/s,1 m'
{SWEEP} --vary schema=1,2
{SWEEP} --vary gravity=1,2 --vary gravity=3,4
{SWEEP} --vary gravty=1,2 --dry-run
{SWEEP} --mode lhs --vary {KINETIC}=0.1:0.3 --vary 'time.end=1 s+-1 mm' --samples 0 --seed -1
{VARIED} --shard 2/2
{VARIED} --shard 0/2 --overwrite
{VARIED} --executor dask
{VARIED} --executor thread
{VARIED} --merge out
verify V2 V99
verify V2 V5 --scheme nonsmooth
verify V5 --law hertz-mindlin --scheme nonsmooth
verify V5 --model kernel --scheme nonsmooth
""".strip().splitlines()

SWEPT = "case,status,reason,block.x_mm\n1,finished,,42.0\n2,finished,,43.5\n"
MEASURED = "block,quantity,unit,replicate,value\nblock,x,mm,1,41\nblock,x,mm,2,43\n"


@pytest.fixture
def place(blocksim: Command, finished: Path, tmp_path: Path) -> Path:
    """Give a folder with a run, a sweep, tables, broken scenarios and files of other people."""
    slide = (SCENARIOS / "slide.toml").read_text()
    texts = {
        "slide.toml": slide,
        "big.toml": slide.replace("[time]\n", '[time]\nstep = "1 ms"\n'),
        "thin.toml": slide.replace("[contact]\n", '[contact]\nskin = "5 um"\n'),
        "bad.toml": "schema = 2\n",
        "measured.csv": MEASURED,
        "swept/sweep.csv": SWEPT,
        "broken/sweep.csv": "a,b\n1,2\n",
        "empty/run.h5": "",
        "foreign/thesis.tex": "years of work",
        **{f"mine.{ending}": "years of work" for ending in ("json", "png", "csv", "pdf", "html")},
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    (tmp_path / "run").symlink_to(finished)
    assert blocksim("--version").code == 0
    return tmp_path


def contents(folder: Path) -> dict[Path, bytes | None]:
    """Return what is in a folder."""
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


@pytest.mark.parametrize("line", LINES, ids=str)
def test_mistakes(blocksim: Command, place: Path, golden: Golden, line: str) -> None:
    before = contents(place)
    answer = blocksim(*shlex.split(line))
    assert answer.out == ""
    assert contents(place) == before
    golden(f"exit code {answer.code}\n{answer.err}")


NEEDED = {
    "ffmpeg of animate": ("imageio_ffmpeg", "animate run --out film.mp4"),
    "pymunk of bench": ("pymunk", "bench --peers"),
    "optuna of calibrate": ("optuna", f"{FIT} {SCATTER}"),
    "scipy of calibrate": ("scipy.stats", f"{FIT} {SCATTER}"),
    "scipy of compare": ("scipy.special", JUDGED),
    "SALib of sensitivity": ("SALib", MORRIS),
    "SALib of sensitivity by Sobol": ("SALib", f"{MORRIS} --method sobol"),
}


@pytest.mark.usefixtures("place")
@pytest.mark.parametrize(("package", "line"), NEEDED.values(), ids=NEEDED)
def test_missing_packages(
    blocksim: Command, golden: Golden, monkeypatch: pytest.MonkeyPatch, package: str, line: str
) -> None:
    for name in [name for name in sys.modules if f"{name}.".startswith(f"{package}.")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setenv("PATH", "")
    answer = blocksim(*shlex.split(line))
    assert (answer.code, answer.out) == (69, "")
    golden(answer.err)
