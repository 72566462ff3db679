"""The SPH example of the README gives the output that stands below it."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[3]
TEXT = (ROOT / "blocksim/kernels/README.md").read_text(encoding="utf-8")
EXAMPLE = re.compile(
    r"<!-- sph example -->\n```python\n(.*?)```\n\n```\n(.*?)```\n<!-- end of sph example -->", re.DOTALL
)


def test_example_prints_what_the_readme_says(tmp_path: Path) -> None:
    found = EXAMPLE.search(TEXT)
    assert found is not None
    (tmp_path / "example.py").write_text(found.group(1), encoding="utf-8")
    done = subprocess.run([sys.executable, "example.py"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == found.group(2)
