"""The page: names from a scenario never become markup, runs of one name are told apart by their keys."""

import json
import re
from base64 import b64encode
from dataclasses import replace
from hashlib import sha256
from html import unescape
from pathlib import Path

from blocksim.simulation.balance import EnergyLedger
from blocksim.simulation.observables import Movement, Response
from blocksim.view.report.page import labels, page_text
from blocksim.view.report.subjects import CaseTable, Subject, read_folder, run_subject, sweep_subject
from tests.view.report.folders import write_run

HOSTILE = ("<script>alert(1)</script>", "</script><img src=x>", "<!--<script>", "\u202egnp", "{{ 7*7 }}", "x" * 3000)


def test_hostile_names_stay_text(tmp_path: Path) -> None:
    write_run(tmp_path / "run", count=2)
    stored = read_folder(tmp_path / "run")
    assert stored.frames is not None
    table = CaseTable(Path("t"), ("case", "status", "1.x_mm"), (("1", "1", "1.0"),))
    clean = page_text([run_subject("a", stored), sweep_subject("b", table, None, {})])
    tags = r"<(?:script|img|!--)"
    for name in HOSTILE:
        frames = replace(stored.frames, names=(name, "2", "3"))
        run = replace(stored, frames=frames, scenario_text=name, problems=(name,))
        table = CaseTable(Path(name[:100]), ("case", "status", f"{name}.x_mm"), ((name, name, "1.0"),))
        subjects = [replace(run_subject("a", run), name=name), sweep_subject("b", table, None, {})]
        text = page_text(subjects)
        assert len(re.findall(tags, text)) == len(re.findall(tags, clean)), name
        found = re.search(r'id="a-data">(.*?)</script>', text, re.DOTALL)
        assert found
        assert json.loads(found[1])["frames"]["names"][0] == name


def test_page_runs_nothing_but_its_own_script_and_style(tmp_path: Path) -> None:
    write_run(tmp_path / "run", count=2)
    text = page_text([run_subject("a", read_folder(tmp_path / "run"))])
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]*)"', text)
    allowed = dict(part.split(" ", 1) for part in unescape(policy).split("; "))
    own = {
        kind: f"'sha256-{b64encode(sha256(content.encode()).digest()).decode()}'"
        for kind, content in re.findall(r"<(script|style)>(.*?)</\1>", text, re.DOTALL)
    }
    expected = {f"{kind}-src": source for kind, source in own.items()}
    shut = dict.fromkeys(("default-src", "base-uri", "form-action"), "'none'")
    assert allowed == {**shut, **expected, "img-src": "data:"}
    assert set(own) == {"script", "style"}
    assert not re.search(r"<[^>]*\s(style|on\w+)=", re.sub(r"<(script|style).*?</\1>", "", text, flags=re.DOTALL))


def subject(folder: Path, key: str, name: str = "three_blocks", **settings: object) -> Subject:
    overrides = {text.replace("__", "."): value for text, value in settings.items()}
    write_run(folder / key, name, count=2, overrides=overrides)
    return run_subject(key, read_folder(folder / key))


def test_runs_of_one_name_are_labelled_with_the_keys_that_differ(tmp_path: Path) -> None:
    one = subject(tmp_path, "a", friction__block_block=0.3)
    other = subject(tmp_path, "b", friction__block_block=0.5, gravity=1.62)
    alone = subject(tmp_path, "c", "slide")
    assert labels([one, other, alone]) == {
        "a": "gravity = 9.81, friction.block_block.static = 0.3",
        "b": "gravity = 1.62, friction.block_block.static = 0.5",
    }
    assert "gravity = 1.62, friction.block_block.static = 0.5" in page_text([one, other])


def test_report_names_the_outcome_and_the_block_that_moved_first(tmp_path: Path) -> None:
    write_run(tmp_path / "run", count=2)
    stored = read_folder(tmp_path / "run")
    assert stored.summary is not None
    known = {
        "outcome": Response.FELL,
        "largest_displacement_mm": 12.3,
        "displaced_block": "2",
        "largest_rotation_deg": 90.0,
        "rotated_block": "3",
        "first_mover": "3",
        "first_moved_s": 0.045,
        "fastest_m_s": 0.1,
    }
    movement = Movement.model_validate(known)
    moved = replace(stored, summary=stored.summary.model_copy(update={"movement": movement}))
    rows = dict(run_subject("a", moved).page["summary"])
    assert rows["outcome"] == "fell"
    assert rows["peak displacement"] == "12.30 mm (block 2)"  # on the way: it may end nearer
    assert rows["peak rotation"] == "90.00° (block 3)"
    assert rows["first to move"] == "block 3 at 0.045 s"
    assert "outcome" not in dict(run_subject("a", stored).page["summary"])


def test_ledger_has_all_entries_that_are_not_zero_and_no_empty_cell(tmp_path: Path) -> None:
    write_run(tmp_path / "run", count=3)
    stored = read_folder(tmp_path / "run")
    assert stored.summary is not None
    entries = {"kinetic": 0.1, "potential": 4.9, "events": -0.25, "start": 5.0, "in_play": 1.0}
    further = {"sand_kinetic": 0.125, "friction": -1e-16}  # the second is round-off
    ledger = EnergyLedger.model_validate({**entries, **further})
    summary = stored.summary.model_copy(update={"energy_J": ledger})
    subject = run_subject("part-1", replace(stored, summary=summary))
    names = [name for name, _ in subject.page["ledger"]]
    assert names == ["sand kinetic", "kinetic", "potential", "taken by events", "at the start", "in play", "residual"]
    text = page_text([subject])
    table = text.partition('<table class="ledger">')[2].partition("</table>")[0]
    assert table.count("<tr>") == len(names)
    assert "−0.25</td>" in table
    assert "></td>" not in table
