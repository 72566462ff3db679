"""The package: the same bytes twice, of use to somebody with nothing but the wheel, and locked versions."""

import re
import tomllib
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


def test_only_what_git_tracks_is_packed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = tmp_path / "root"
    (root / "room").mkdir(parents=True)
    for name in ("kept.py", "room/kept ü.py", "gone.py", "notes.txt", "room/private.key"):
        (root / name).write_text(name)
    for words in (("init", "-q"), ("add", "kept.py", "room/kept ü.py", "gone.py")):
        dist.call("git", *words, folder=root)
    (root / "gone.py").unlink()
    monkeypatch.setattr(dist, "ROOT", root)
    copy = dist.tracked_files(tmp_path / "copy")
    assert {str(path.relative_to(copy)) for path in copy.rglob("*.*")} == {"kept.py", "room/kept ü.py"}


@pytest.mark.long
def test_a_wheel_is_all_that_somebody_needs(tmp_path: Path) -> None:
    made = dist.build_all(tmp_path / "dist")
    (tmp_path / "somewhere").mkdir()
    dist.try_wheel(made[1], tmp_path / "somewhere")


ROOT = Path(__file__).parents[1]
LOCKED = sorted((ROOT / "tests").glob("constraints*.txt"))
ENTRY = re.compile(r"^([a-z0-9][a-z0-9-]*)==([^ ;\\]+)", flags=re.MULTILINE)
EXTRAS = {
    "constraints.txt": ("study",),
    "constraints-dev.txt": ("study", "dev", "dxf"),
    "constraints-docs.txt": ("docs", "dist"),
    "constraints-bench.txt": ("bench",),
    "constraints-paraview-check.txt": ("paraview-check",),
}


def normal(name: str) -> str:
    """Return a name as indexes compare it."""
    return re.sub(r"[-_.]+", "-", re.split(r"[<>=!~\[ ;]", name)[0]).lower()


def versions(path: Path) -> dict[str, str]:
    """Return what a file and those that it includes lock."""
    text = path.read_text()
    included = (
        {} if (match := re.search(r"^-r (.*)$", text, flags=re.MULTILINE)) is None else versions(path.parent / match[1])
    )
    return {**included, **dict(ENTRY.findall(text))}


@pytest.fixture(scope="module")
def project() -> dict[str, object]:
    """Return pyproject.toml."""
    return tomllib.loads((ROOT / "pyproject.toml").read_text())


@pytest.mark.parametrize("path", LOCKED, ids=lambda path: path.name)
def test_every_version_has_hashes_and_no_address(path: Path) -> None:
    text = path.read_text()
    assert not re.search(r"https?:|//|--(extra-)?index|--find-links|--trusted", text)
    for entry in re.split(r"\n(?=[a-z0-9])", text.partition("\n")[2].removeprefix("-r constraints.txt\n")):
        assert re.match(r"[a-z0-9-]+==\S+( ; [^\\]+)? \\\n( +--hash=sha256:[0-9a-f]{64}( \\)?\n?)+$", entry), entry[:80]


@pytest.mark.parametrize("path", LOCKED, ids=lambda path: path.name)
def test_everything_that_the_project_asks_for_is_locked(path: Path, project: dict) -> None:  # type: ignore[type-arg]
    asked = list(project["project"]["dependencies"])
    for extra in EXTRAS[path.name]:
        asked += [one for one in project["project"]["optional-dependencies"][extra] if not one.startswith("blocksim")]
    assert {normal(one) for one in asked} <= set(versions(path))


def test_builder_is_locked_at_the_version_that_it_is_asked_for(project: dict) -> None:  # type: ignore[type-arg]
    (wanted,) = project["build-system"]["requires"]
    name, version = wanted.split("==")
    assert versions(ROOT / "tests" / "constraints.txt")[name] == version


def test_no_two_files_lock_different_versions() -> None:
    locked = [dict(ENTRY.findall(path.read_text())) for path in LOCKED]
    names = [name for one in locked for name in one]
    shared = {name for name in names if names.count(name) > 1}
    assert all(len({one[name] for one in locked if name in one}) == 1 for name in shared)


def test_pip_is_locked_too_and_not_the_one_that_python_comes_with() -> None:
    import ensurepip  # noqa: PLC0415

    locked, bundled = versions(ROOT / "tests" / "constraints.txt")["pip"], ensurepip.version()
    assert [*map(int, locked.split("."))] >= [*map(int, bundled.split("."))]
