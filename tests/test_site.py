"""The site: builds without a warning, leads nowhere that is not there, and its pages have commands that work."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import blocksim
from blocksim.cli.commands import COMMANDS
from tests import site

PAGES = sorted(path for path in site.OWN.rglob("*.md") if "```bash" in path.read_text(encoding="utf-8"))


def test_every_page_is_in_the_site_and_formulas_are_typeset(quick_site: Path) -> None:
    for page in site.repository_pages():
        assert (quick_site / site.place_of(page)).with_suffix(".html").is_file(), page
    theory = (quick_site / "theory.html").read_text(encoding="utf-8")
    assert theory.count("<math") > 20
    assert "$" not in re.sub(r"<script.*?</script>", "", theory, flags=re.DOTALL)


def test_the_site_loads_nothing_from_elsewhere(quick_site: Path) -> None:
    for path in quick_site.rglob("*.html"):
        loaded = re.findall(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="?(https?:[^" >]+)', path.read_text("utf-8"))
        assert [one for one in loaded if "squidfunk" not in one] == [], path


def test_a_link_that_leads_nowhere_is_found(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text('<p id="here"><a href="b.html">b</a><a href="#there">c</a><a href="#here">d</a>')
    assert site.broken_links(tmp_path) == ["a.html: b.html", "a.html: #there"]


def test_references_name_every_command_key_and_function() -> None:
    commands, functions = site.commands_page(), site.api_page()
    assert [name for name in COMMANDS if f"\n### {name}\n" not in commands] == []
    assert [name for name in blocksim.__all__ if f"\n## {name}\n" not in functions] == []
    assert "`--stiffer" not in site.paragraphs_of(blocksim.run.__doc__ or "")
    assert "* `threads`: Threads, for scenes" in site.paragraphs_of(blocksim.run.__doc__ or "")


@pytest.mark.long
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_commands_of_a_page_work_as_they_are_written(page: Path, tmp_path: Path) -> None:
    blocks = re.findall(r"^```bash\n(.*?)^```", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)
    environment = {**os.environ, "PATH": f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"}
    shell = shutil.which("bash")
    assert shell is not None
    script = "set -eu\n" + "\n".join(blocks)
    done = subprocess.run(
        [shell, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.long
def test_the_whole_site_is_small_enough(tmp_path: Path) -> None:
    for needed in ("mkdocs", "material", "latex2mathml", "nbclient"):
        pytest.importorskip(needed)
    assert site.build(tmp_path / "site") < site.MOST_BYTES
    assert len([*(tmp_path / "site/gallery").glob("*.gif")]) == len(site.GALLERY)
