"""A run shown while it computes: a page on the loopback address of this machine, which reads the folder of the run.

Beside a run the server is a process of its own, so that it takes no part in the computation; it ends when the pipe from
the run is closed, however the run ends. It answers requests for this address only, and sends nothing anywhere. Other
users of this machine reach the server too, and so its address has a random part, which it gives to the run alone.
"""

import json
import re
import secrets
import select
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from socketserver import ThreadingMixIn
from typing import Any
from wsgiref.simple_server import WSGIRequestHandler, WSGIServer, make_server

from blocksim.errors import BlocksimError
from blocksim.simulation import files
from blocksim.study import report, run_folder
from blocksim.view.report import page, subjects

HOST = "127.0.0.1"
LAST_SECONDS = 3.0  # after the end of a run, in which an open page fetches the last frame
PATIENCE = 30.0  # s for a server to start, and to end after LAST_SECONDS; it may be stopped, and is killed then
HEADERS = (("Cache-Control", "no-store"), ("X-Content-Type-Options", "nosniff"), ("Referrer-Policy", "no-referrer"))
Start = Callable[[str, list[tuple[str, str]]], object]


class LivePage:
    """What is answered about the run in a folder; called as WSGI applications are."""

    def __init__(self, folder: Path) -> None:
        """Begin before anybody has asked."""
        self.folder, self.place = folder, f"/{secrets.token_urlsafe()}"
        self.lock = threading.Lock()
        self.is_open = False  # whether a page has asked
        self.last_shown = ""  # version of the report that was sent last

    def __call__(self, request: dict[str, Any], start: Start) -> Iterable[bytes]:
        """Answer a request: the page, `state`, what the run has come to, or `report`, all in the place of this run."""
        host = str(request.get("HTTP_HOST", "")).rpartition(":")[0]
        place, _, asked = str(request.get("PATH_INFO", "/")).rpartition("/")
        if request.get("REQUEST_METHOD") != "GET" or host not in {HOST, "localhost"}:
            return self._refused("403 Forbidden", start)
        is_known = secrets.compare_digest(place.encode(errors="replace"), self.place.encode())
        if not is_known or asked not in {"", "state", "report"}:
            return self._refused("404 Not Found", start)
        self.is_open = True
        kind, version, policy = "text/html; charset=utf-8", "", "default-src 'none'"
        with self.lock:
            if asked == "state":
                kind, text = "application/json", json.dumps(self.state())
            elif asked == "report":  # it has a policy of its own, which cannot say this
                version, text, policy = self.version(), self.report(), "frame-ancestors 'self'"
            else:
                text, policy = live_page()
        start("200 OK", [("Content-Type", kind), ("Content-Security-Policy", policy), *HEADERS])
        return self._sent(text.encode(errors="replace"), version)

    def _refused(self, status: str, start: Start) -> Iterable[bytes]:
        start(status, [*HEADERS])  # a new list, as the server adds to it
        return [b""]

    def _sent(self, content: bytes, version: str) -> Iterator[bytes]:
        yield content
        self.last_shown = version or self.last_shown

    def version(self) -> str:
        """Return a text that changes with what the folder holds; empty before the first frame."""
        marks = []
        for name in (files.FRAMES, files.SUMMARY):
            with suppress(OSError):
                found = (self.folder / name).stat()
                marks.append(f"{found.st_mtime_ns}-{found.st_size}")
        return "_".join(marks)

    def state(self) -> dict[str, object]:
        """Return version, name, time and end (s), kinetic energy (J) and number of frames, as far as there are any."""
        version = self.version()
        try:
            run = run_folder.read_run(self.folder)
        except BlocksimError:
            return {"version": "", "ended": False}
        kinetic = run.frames.energy.get("kinetic")
        return {
            "version": version,
            "ended": (self.folder / files.SUMMARY).is_file(),
            "name": run.model.scenario.name,
            "time": float(run.frames.time[-1]),
            "end": run.model.scenario.time.end,
            "kinetic": None if kinetic is None else float(kinetic[-1]),
            "frames": len(run.frames),
        }

    def report(self) -> str:
        """Return the report of the run as far as it got."""
        try:
            if (self.folder / files.SUMMARY).is_file():
                parts, _ = report.subjects_of([self.folder])
            else:  # what is missing is to come
                parts = [subjects.run_subject("part-1", replace(subjects.read_folder(self.folder), problems=()))]
        except BlocksimError:
            return ""
        return page.page_text(parts)


@cache
def live_page() -> tuple[str, str]:
    """Return the text of the page, and its policy: its own style and script, its state and its report."""
    text = (page.PARTS / "live.html").read_text(encoding="utf-8")
    style, script = (re.findall(f"<{kind}>(.*?)</{kind}>", text, re.DOTALL)[0] for kind in ("style", "script"))
    return text, page.policy_of(style, script, "connect-src 'self'", "frame-src 'self'", "frame-ancestors 'none'")


class _Server(ThreadingMixIn, WSGIServer):
    """A thread for every connection: browsers open some that they do not use yet."""

    daemon_threads = True
    block_on_close = False

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Report what is wrong here, and not that a browser has gone."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Silent(WSGIRequestHandler):
    def log_message(self, format: str, *values: Any) -> None:  # noqa: A002 - the name is the base class's
        """Print nothing."""


@contextmanager
def open_server(folder: Path) -> Iterator[tuple[WSGIServer, LivePage, str]]:
    """Give a server of a run's folder on a free port of the loopback address, its answers, and its address."""
    answers = LivePage(folder)
    with make_server(HOST, 0, answers, _Server, _Silent) as server:
        server.timeout = 0.2  # for a request, before the end is looked for
        yield server, answers, f"http://{HOST}:{server.server_port}{answers.place}/"


def serve(folder: Path, on_address: Callable[[str], object]) -> None:
    """Show the run in a folder until Ctrl-C."""
    with open_server(folder) as (server, _, address):
        on_address(address)
        with suppress(KeyboardInterrupt):
            while True:
                server.handle_request()


@contextmanager
def beside_run(folder: Path) -> Iterator[str]:
    """Show the run that goes into a folder until it ends; give the address of the page, empty without one."""
    command = [sys.executable, "-P", "-m", __name__, str(folder)]
    server: Any  # with pipes
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as server:  # noqa: S603 - this program
        try:
            started, _, _ = select.select([server.stdout], [], [], PATIENCE)
            yield server.stdout.readline().strip() if started else ""
        finally:
            server.stdin.close()
            try:
                server.wait(LAST_SECONDS + PATIENCE)
            except subprocess.TimeoutExpired:
                server.kill()


def _main(folder: Path) -> None:
    """Serve until standard input ends, and then until an open page has the end of the run."""
    ended = threading.Event()

    def wait() -> None:
        sys.stdin.read()
        ended.set()

    threading.Thread(target=wait, daemon=True).start()
    with open_server(folder) as (server, answers, address):
        sys.stdout.write(f"{address}\n")
        sys.stdout.flush()
        while not ended.is_set():
            server.handle_request()
        over = time.monotonic() + LAST_SECONDS
        while answers.is_open and time.monotonic() < over and answers.last_shown != answers.version():
            server.handle_request()


if __name__ == "__main__":
    with suppress(KeyboardInterrupt):
        _main(Path(sys.argv[1]))
