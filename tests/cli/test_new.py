"""blocksim new: every template works as it is, and nothing is replaced."""

import errno
import stat
from pathlib import Path

import pytest

from blocksim.cli import new
from blocksim.cli.new import templates
from blocksim.scenario import load_scenario
from tests.cli.conftest import Command

SCENARIOS = [kind for kind, file in templates().items() if file.name.endswith(".toml")]
SWEEPS = [kind for kind in SCENARIOS if kind.startswith("sweep-")]


@pytest.mark.parametrize("kind", SCENARIOS)
def test_a_new_scenario_passes_the_check(blocksim: Command, kind: str) -> None:
    made = blocksim("new", kind, "mine")
    assert (made.code, made.out) == (0, "mine.toml\n")
    assert made.err == f"next: blocksim {'sweep mine.toml --dry-run' if kind in SWEEPS else 'check mine.toml'}\n"
    assert blocksim("check", "mine.toml").code == 0
    assert load_scenario("mine.toml").name == "mine"
    assert "@" not in Path("mine.toml").read_text()
    if kind in SWEEPS:
        answer = blocksim("sweep", "mine.toml", "--dry-run")
        assert (answer.code, answer.err) == (0, "")
        assert "cannot be simulated" not in answer.out


COMMENTED = {
    "wall": ("missing", "shear_velocity"),
    "voronoi": ("smallest",),
    "retaining-wall": ("cohesion", "lifts"),
    "soil-slope": ("cohesion",),
    "sweep-grid": ('"contact.stiffness_scale"',),
    "sweep-sobol": ('"contact.stiffness_scale"',),
}


@pytest.mark.parametrize(("kind", "key"), [(kind, key) for kind, keys in COMMENTED.items() for key in keys])
def test_a_line_left_in_a_comment_works_too(blocksim: Command, kind: str, key: str) -> None:
    blocksim("new", kind, "mine")
    text = Path("mine.toml").read_text()
    assert text.count(f"# {key} = ") == 1
    Path("mine.toml").write_text(text.replace(f"# {key} = ", f"{key} = "))
    assert blocksim("check", "mine.toml").code == 0


def test_a_new_table_can_be_compared_with(blocksim: Command) -> None:
    assert blocksim("new", "experiment", "data.csv").out == "data.csv\n"
    scenario = Path("scenarios/three_blocks_nominal.toml").read_text()
    Path("mine.toml").write_text(scenario.replace("experiments/three_blocks.csv", "data.csv"))
    assert blocksim("check", "mine.toml").code == 0


def test_the_list_has_a_line_for_every_template_and_every_scenario_that_ships(blocksim: Command) -> None:
    lines = blocksim("new", "--list").out.splitlines()
    shown = {line.split()[0]: line.split(maxsplit=1)[1] for line in lines}  # none without its text
    assert set(templates()) <= set(shown)
    assert {path.as_posix() for path in Path("scenarios").rglob("*.toml")} <= set(shown)


def test_scenarios_that_ship_are_copied_with_their_tables(blocksim: Command) -> None:
    made = blocksim("new", "scenarios", "all")
    assert (made.code, made.out, made.err) == (0, "all\n", "next: blocksim run all/three_blocks.toml\n")
    assert load_scenario("all/record_column.toml").motion is not None
    assert load_scenario("all/three_blocks.toml").experiment is not None
    assert blocksim("new", "scenarios", "all").code == 73


def test_a_full_disk_leaves_no_half_file(blocksim: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("os.fsync", fail)
    answer = blocksim("new", "stack", "mine")
    assert (answer.code, answer.err) == (74, "mine.toml: cannot be written: No space left on device\n")
    assert not Path("mine.toml").exists()


def test_scenarios_copied_from_a_read_only_package_can_be_edited(
    blocksim: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "package"
    (package / "soil").mkdir(parents=True)
    for name in ("a.toml", "soil/b.toml"):
        (package / name).write_text("schema = 1\n")
        (package / name).chmod(0o444)
    (package / "soil").chmod(0o555)
    monkeypatch.setattr(new, "shipped", lambda: package)
    assert blocksim("new", "scenarios", "mine").code == 0
    copied = [Path("mine"), *Path("mine").rglob("*")]
    assert len(copied) == 4
    assert all(path.stat().st_mode & stat.S_IWUSR for path in copied)
    (package / "soil").chmod(0o755)
