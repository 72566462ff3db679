"""python -m tests.dist: builds the package, and tries it as somebody who has nothing but the wheel.

    python -m tests.dist [--out dist]

Builds sdist and wheel twice, the wheel also from the unpacked sdist, and compares hashes; checks the metadata with
twine; installs the wheel with plain pip into an empty environment outside the checkout, and there makes a scenario,
runs it, compares, writes a report and runs the Python example of README.md.
"""

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import venv
from pathlib import Path
from tempfile import TemporaryDirectory

ROOT = Path(__file__).parents[1]


def call(*command: str | Path, folder: Path, environment: dict[str, str] | None = None) -> str:
    """Run a command, show what it prints, and return it. Raises CalledProcessError."""
    sys.stdout.write(f"$ {' '.join(map(str, command))}\n")
    text = subprocess.run(command, cwd=folder, env=environment, stdout=subprocess.PIPE, text=True, check=True).stdout
    sys.stdout.write(text)
    sys.stdout.flush()
    return text


def last_commit() -> str:
    """Return the time of the last commit in seconds since 1970; that of the licence in an unpacked sdist."""
    git = shutil.which("git")
    command = [git or "git", "log", "-1", "--format=%ct"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    return found.stdout.strip() or str(int((ROOT / "blocksim/LICENSE").stat().st_mtime))


def tracked_files(copy: Path) -> Path:
    """Return a copy of what git tracks, so that nothing else that lies here is packed; of an unpacked sdist all."""
    command = [shutil.which("git") or "git", "ls-files", "-z"]
    found = subprocess.run(command, cwd=ROOT, capture_output=True, check=False) if (ROOT / ".git").exists() else None
    if found is None or found.returncode:
        return ROOT
    for name in filter(None, os.fsdecode(found.stdout).split("\0")):
        if (ROOT / name).is_file():  # it may be deleted and not committed yet
            (copy / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, copy / name)
    return copy


def build(source: Path, target: Path, kind: str, epoch: str) -> Path:
    """Build `sdist` or `wheel` of a source folder; return the file."""
    before = set(target.glob("*"))
    environment = {**os.environ, "SOURCE_DATE_EPOCH": epoch, "PYTHONPATH": ""}
    call(sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", target, folder=source, environment=environment)
    (made,) = set(target.glob("*")) - before
    return made


def digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def build_all(out: Path) -> list[Path]:
    """Build both files twice; return those in the folder. Raises ValueError where their hashes differ."""
    out.mkdir(parents=True, exist_ok=True)
    for old in (*out.glob("blocksim-*.whl"), *out.glob("blocksim-*.tar.gz")):
        old.unlink()
    epoch = last_commit()
    with TemporaryDirectory() as folder:
        checkout = tracked_files(Path(folder) / "checkout")
        made = [build(checkout, out, kind, epoch) for kind in ("sdist", "wheel")]
        again = Path(folder) / "again"
        again.mkdir()
        with tarfile.open(made[0]) as packed:
            packed.extractall(folder)  # noqa: S202 - built here, a line above; 3.11.2 knows no filter
        (source,) = Path(folder).glob("blocksim-*")
        others = [build(checkout, again, "sdist", epoch), build(source, again, "wheel", epoch)]
        for one, other in zip(made, others, strict=True):
            if digest(one) != digest(other):
                raise ValueError(f"{one.name}: two builds differ")
    return made


def example() -> str:
    """Return the Python example of the first page."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    found = re.search(r"```python\n(.*?)```", text, flags=re.DOTALL)
    assert found is not None
    return found[1]


def try_wheel(wheel: Path, folder: Path) -> None:
    """Install a wheel in a new environment and use it there, in an empty folder. Raises CalledProcessError."""
    venv.create(folder / "venv", with_pip=True)
    programs, place = folder / "venv" / "bin", folder / "work"
    place.mkdir()
    clean = {name: value for name, value in os.environ.items() if name not in {"PYTHONPATH", "VIRTUAL_ENV"}}
    call(programs / "python", "-m", "pip", "install", "-q", wheel.resolve(), folder=place, environment=clean)
    blocksim = programs / "blocksim"
    for line in (
        "new --list",
        "new three-blocks mine",
        "run mine.toml",
        "new scenarios scenarios",
        "run scenarios/three_blocks.toml",
        "compare scenarios/three_blocks.toml",
        "plot scenarios/three_blocks.toml",
        "report scenarios/three_blocks.toml",
    ):
        call(blocksim, *line.split(), folder=place, environment=clean)
    (place / "example.py").write_text(example(), encoding="utf-8")
    call(programs / "python", "example.py", folder=place, environment=clean)
    made = {path.name for path in place.iterdir()}
    missing = {"mine.toml", "three_blocks.png", "report.html", "results"} - made
    if missing:
        raise ValueError(f"not written: {', '.join(sorted(missing))}")


def main() -> None:
    """Build, check and try the package; print sizes and hashes."""
    parser = argparse.ArgumentParser(description="Build the package and try it in an empty environment.")
    parser.add_argument("--out", type=Path, default=ROOT / "dist")
    out = parser.parse_args().out.resolve()
    made = build_all(out)
    call(sys.executable, "-m", "twine", "check", "--strict", *made, folder=ROOT)
    with TemporaryDirectory() as folder:
        try_wheel(made[1], Path(folder))
    for path in made:
        sys.stdout.write(f"{path.name}  {path.stat().st_size / 1e6:.2f} MB  sha256 {digest(path)}\n")


if __name__ == "__main__":
    main()
