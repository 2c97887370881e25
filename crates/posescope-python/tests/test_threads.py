"""Threads, Ctrl-C, forks and panics."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time

import pytest

import posescope


@pytest.mark.parametrize("method", ["fb", "mi", "robust"])
def test_the_number_of_threads_changes_no_byte(street: posescope.Scene, method: str) -> None:
    query, reference = street.query("70"), street.reference("62")
    lines = [
        posescope.localize(query, reference, method=method, threads=threads).to_json()
        for threads in (1, 2, None)
    ]
    assert lines[0] == lines[1] == lines[2]


def test_other_threads_go_on_meanwhile(street: posescope.Scene) -> None:
    ticks = 0
    stop = threading.Event()

    def tick() -> None:
        nonlocal ticks
        while not stop.wait(0.001):
            ticks += 1

    counter = threading.Thread(target=tick)
    counter.start()
    start = time.monotonic()
    posescope.localize(street.query("70"), street.reference("62"), method="mi", radius=20, threads=1)
    took = time.monotonic() - start
    stop.set()
    counter.join()
    assert ticks > 50 * took


def test_ctrl_c_stops_it(street: posescope.Scene) -> None:
    query, reference = street.query("70"), street.reference("62")
    sent = 0.0

    def press() -> None:
        nonlocal sent
        time.sleep(0.2)
        sent = time.monotonic()
        os.kill(os.getpid(), signal.SIGINT)

    presser = threading.Thread(target=press)
    with pytest.raises(KeyboardInterrupt):
        presser.start()
        posescope.localize(query, reference, method="mi", radius=200)
    stopped = time.monotonic()
    presser.join()
    # 50 ms on an idle machine; tests share theirs.
    assert stopped - sent < 0.5
    assert posescope.localize(query, reference, method="fb").grade == "right"


def _localize_in_child(queue: "multiprocessing.Queue[str]") -> None:
    street = posescope.Scene.street()
    result = posescope.localize(street.query("70"), street.reference("62"), method="fb")
    queue.put(result.to_json())


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_a_forked_process_localises_too(street: posescope.Scene) -> None:
    here = posescope.localize(street.query("70"), street.reference("62"), method="fb")
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=_localize_in_child, args=(queue,))
    child.start()
    assert queue.get(timeout=60) == here.to_json()
    child.join()


def test_a_panic_is_an_exception_and_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    # The command prints panics in a way of its own, which must end with it.
    posescope.main(["--version"])
    capfd.readouterr()
    with pytest.raises(posescope.InternalError, match=r"a panic on purpose \(.*detached\.rs:\d+\)"):
        posescope._posescope.panic()
    assert capfd.readouterr() == ("", "")
