"""The page as a text: names from a scenario never become markup."""

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest

from blocksim.view.report.page import page_text
from blocksim.view.report.stored import read_stored
from blocksim.view.report.subjects import run_subject
from blocksim.view.report.sweeps import SweepTable, sweep_subject
from tests.view.report.folders import write_run

HOSTILE = ("<script>alert(1)</script>", "</script><img src=x>", "<!--<script>", "\u202egnp", "{{ 7*7 }}", "x" * 3000)


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_names_stay_text(tmp_path: Path, name: str) -> None:
    write_run(tmp_path / "run", count=2)
    stored = read_stored(tmp_path / "run")
    assert stored.frames is not None
    frames = replace(stored.frames, names=(name, "2", "3"))
    run = replace(stored, frames=frames, scenario_text=name, problems=(name,))
    table = SweepTable(Path(name[:100]), ("case", "status", f"{name}.x_mm"), ((name, name, "1.0"),))
    subjects = [replace(run_subject("a", run), name=name), sweep_subject("b", table, None, {})]
    clean = page_text([run_subject("a", stored), sweep_subject("b", table, None, {})], title="", version="0")
    text = page_text(subjects, title=name, version="0")
    tags = r"<(?:script|img|!--)"
    assert len(re.findall(tags, text)) == len(re.findall(tags, clean))
    found = re.search(r'id="a-data">(.*?)</script>', text, re.DOTALL)
    assert found
    assert json.loads(found[1])["frames"]["names"][0] == name
