"""Signals are taken over only where nobody else has, and given back."""

import os
import signal
import threading
import time

import pytest

from blocksim.simulation.interruption import WallTime, interruptible, stop_requests


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGUSR1])
def test_signal_becomes_a_request_and_the_handler_comes_back(number: signal.Signals) -> None:
    before = signal.getsignal(number)
    with stop_requests() as is_stopped:
        assert not is_stopped()
        os.kill(os.getpid(), number)
        assert is_stopped()
        assert is_stopped.reason() == f"stopped by {number.name}"
    assert signal.getsignal(number) is before


def test_second_signal_stops_at_once_but_only_when_the_first_was_heard() -> None:
    with stop_requests() as requests:
        for _ in range(2):  # a terminal and a launcher may both send one
            os.kill(os.getpid(), signal.SIGTERM)
        assert requests.reason() == "stopped by SIGTERM"
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)


def test_limit_of_wall_time_is_a_reason_to_stop_once_it_is_over() -> None:
    assert WallTime(None).reason() == WallTime(60.0).reason() == ""
    limit = WallTime(0.01)
    time.sleep(0.02)
    assert limit.reason() == "wall-time limit of 0.01 s reached"
    assert WallTime(60.0, 61.0).reason() == "wall-time limit of 60 s reached"


def test_handler_of_somebody_else_stays() -> None:
    heard = []
    before = signal.signal(signal.SIGINT, lambda *_: heard.append("mine"))
    try:
        with stop_requests() as is_stopped:
            os.kill(os.getpid(), signal.SIGINT)
            assert not is_stopped()
    finally:
        signal.signal(signal.SIGINT, before)
    assert heard == ["mine"]


def test_runs_in_other_threads_leave_signals_alone() -> None:
    answers: list[bool] = []

    def ask() -> None:
        with stop_requests() as is_stopped:
            answers.append(is_stopped())

    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    assert answers == [False]


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT])
def test_being_terminated_is_like_ctrl_c_during_a_study(number: signal.Signals) -> None:
    with pytest.raises(KeyboardInterrupt), interruptible():
        os.kill(os.getpid(), number)
    assert signal.getsignal(number) is signal.SIG_DFL


def test_lost_connection_stays_ignored_where_nohup_wants_that() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with stop_requests() as is_stopped:
            os.kill(os.getpid(), signal.SIGHUP)
            assert not is_stopped()
    finally:
        signal.signal(signal.SIGHUP, before)
