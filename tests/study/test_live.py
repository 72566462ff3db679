"""The live page: what it answers and to whom, and that it ends with the run and changes nothing of it."""

import json
import re
import signal
import socket
import struct
import subprocess
from base64 import b64encode
from hashlib import sha256
from pathlib import Path
from typing import Any
from urllib.error import HTTPError, URLError
from urllib.parse import urlsplit
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


def test_nobody_else_is_answered_and_that_takes_nothing_from_the_run(tmp_path: Path) -> None:
    with live.beside_run(tmp_path) as address:
        root = address.rsplit("/", 2)[0]
        assert len(address.removeprefix(root)) > 40  # nobody guesses it
        others = ("", "/", "/state", "/report", "/run.h5", f"/{'x' * 43}/state", "//state", "/../run.json")
        for asked, host, code in (
            (address, "example.org:80", 403),
            (f"{address}run.h5", None, 404),
            *((f"{root}{path}", None, 404) for path in others),
        ):
            with pytest.raises(HTTPError) as refused:
                answer(asked, host)
            refused.value.close()
            assert refused.value.code == code
        assert "blocksim live" in answer(address)
        assert json.loads(answer(f"{address}state"))["ended"] is False


def test_pages_run_their_own_script_only_and_are_framed_by_nobody_else(tmp_path: Path) -> None:
    with live.beside_run(tmp_path) as address:
        for asked, frames in (("", "frame-ancestors 'none'"), ("report", "frame-ancestors 'self'")):
            with urlopen(f"{address}{asked}", timeout=30) as got:  # noqa: S310 - of this machine
                policy = got.headers["Content-Security-Policy"]
            assert "unsafe" not in policy
            assert policy.endswith(frames)
    text, policy = live.live_page()
    for kind in ("style", "script"):
        (part,) = re.findall(f"<{kind}>(.*?)</{kind}>", text, re.DOTALL)
        assert f"{kind}-src 'sha256-{b64encode(sha256(part.encode()).digest()).decode()}'" in policy
        assert f" {kind}=" not in text


def test_a_browser_that_goes_is_no_error(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with live.beside_run(tmp_path) as address:
        place = urlsplit(address)
        for sent in (b"", b"GET ", f"GET {place.path}report HTTP/1.1\r\nHost: {place.netloc}\r\n\r\n".encode()):
            with socket.create_connection((place.hostname, place.port)) as caller:
                caller.sendall(sent)
                caller.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # closed by a reset
        assert "blocksim live" in answer(address)
    assert capfd.readouterr().err == ""


def test_a_stopped_server_does_not_hold_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started: list[subprocess.Popen[str]] = []

    def start(*command: Any, **pipes: Any) -> subprocess.Popen[str]:
        started.append(subprocess_popen(*command, **pipes))
        return started[0]

    subprocess_popen = subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", start)
    with live.beside_run(tmp_path):
        started[0].send_signal(signal.SIGSTOP)
        monkeypatch.setattr(live, "PATIENCE", 0.0)
        monkeypatch.setattr(live, "LAST_SECONDS", 0.0)
    assert started[0].returncode == -signal.SIGKILL


def test_a_run_in_progress_is_shown_as_far_as_it_got(tmp_path: Path) -> None:
    blocksim.run(blocksim.load(SLIDE, SOFT), out=tmp_path / "run")
    (tmp_path / "run" / "run.json").unlink()
    (tmp_path / "run" / "final.csv").unlink()
    page = live.LivePage(tmp_path / "run")
    assert not page.state()["ended"]
    assert "could not be read" not in page.report()
    assert "no such file" not in page.report()
