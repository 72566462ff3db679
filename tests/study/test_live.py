"""The live page: what it answers and to whom, and that it ends with the run and changes nothing of it."""

import json
from pathlib import Path
from urllib.error import HTTPError, URLError
from urllib.request import Request, urlopen

import pytest

import blocksim
from blocksim.study import live

SLIDE = Path(__file__).parents[2] / "scenarios/slide.toml"
SOFT = {"contact.stiffness_scale": 0.001}


def answer(address: str, host: str | None = None) -> str:
    """Return what a server answers."""
    request = Request(address, headers={} if host is None else {"Host": host})  # noqa: S310 - of this machine
    with urlopen(request, timeout=30) as got:  # noqa: S310 - as above
        return str(got.read().decode())


def test_a_run_with_a_live_page_has_the_same_bits_and_the_page_ends_with_it(tmp_path: Path) -> None:
    scenario = blocksim.load(SLIDE, SOFT)
    with live.beside_run(tmp_path / "run") as address:
        assert address.startswith("http://127.0.0.1:")
        assert json.loads(answer(f"{address}state")) == {"version": "", "ended": False}
        assert "blocksim live" in answer(address)
        shown = blocksim.run(scenario, out=tmp_path / "run")
        state = json.loads(answer(f"{address}state"))
        assert (state["name"], state["ended"], state["frames"]) == ("slide", True, len(shown.frames))
        assert 'content="blocksim report"' in answer(f"{address}report")
    with pytest.raises(URLError):
        answer(address)
    assert shown.summary.final_state_sha256 == blocksim.run(scenario).summary.final_state_sha256


def test_nobody_else_is_answered(tmp_path: Path) -> None:
    with live.beside_run(tmp_path) as address:
        for path, host, code in (("", "example.org:80", 403), ("run.h5", None, 404), ("../run.json", None, 404)):
            with pytest.raises(HTTPError) as refused:
                answer(f"{address}{path}", host)
            refused.value.close()
            assert refused.value.code == code


def test_a_run_in_progress_is_shown_as_far_as_it_got(tmp_path: Path) -> None:
    blocksim.run(blocksim.load(SLIDE, SOFT), out=tmp_path / "run")
    (tmp_path / "run" / "run.json").unlink()
    (tmp_path / "run" / "final.csv").unlink()
    page = live.LivePage(tmp_path / "run")
    assert not page.state()["ended"]
    assert "could not be read" not in page.report()
    assert "no such file" not in page.report()
