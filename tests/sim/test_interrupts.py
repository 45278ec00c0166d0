"""Processes that leave Ctrl-C to the one that began them."""

from __future__ import annotations

import multiprocessing
import os
import signal
from multiprocessing.connection import Connection

import pytest

from tulip_sim.interrupts import left_to_this_process


def _work(pipe: Connection) -> None:
    pipe.send("begun")
    pipe.recv()
    pipe.send("worked")


@pytest.mark.parametrize("method", ["spawn", "fork"])
@pytest.mark.parametrize("when", ["while it starts", "while it works"])
def test_a_process_begun_within_works_on(method: str, when: str) -> None:
    context = multiprocessing.get_context(method)
    pipe, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs,), daemon=True)
    with left_to_this_process():
        process.start()
    theirs.close()
    assert process.pid is not None
    if when == "while it starts":
        os.kill(process.pid, signal.SIGINT)
    assert pipe.recv() == "begun"
    if when == "while it works":
        os.kill(process.pid, signal.SIGINT)
    pipe.send("work")
    assert pipe.recv() == "worked"
    process.join()
    assert process.exitcode == 0


def test_this_process_hears_afterwards_what_came_meanwhile() -> None:
    with pytest.raises(KeyboardInterrupt), left_to_this_process():
        os.kill(os.getpid(), signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
