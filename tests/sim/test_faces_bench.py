"""The bench of the faces: its table, and the programs that look in people's place."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import pytest

from tulip_sim.bench import faces
from tulip_sim.bench.faces_lookers.looker import PAGE, Looker
from tulip_sim.bench.faces_lookers.terminal import Terminal
from tulip_sim.bench.free_port import free_port
from tulip_sim.bench.processor_time import family_time, processor_time

PATIENCE = 60.0  # [s]


def until(holds: Callable[[], object]) -> None:
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_medians_are_told_of_each_way_and_ratios_of_the_same_round() -> None:
    rows = []
    for number, (without, with_faces) in enumerate([(1.0, 0.9), (0.5, 0.5), (1.0, 1.1)], 1):
        row = {"round": number}
        for way, factor in ((faces.WITHOUT, without), (faces.PROGRAM, with_faces)):
            row |= {f"{way}: {faces.FACTOR}": factor, f"{way}: {faces.ROBOT}": 1.2}
        shares = {"view": 0.1 * number, "bridge": 0.05, "menu": 0.01, "page": 0.2, "viewer": 0.3}
        rows.append(row | {f"{faces.PROGRAM}: {name} [core]": share for name, share in shares.items()})
    table = [line for line in faces.summarize(rows) if line.startswith("|")]
    assert len(table) == 4  # head, and the ways that were played
    cells = [cell.strip() for cell in table[3].split("|")]
    assert cells[2] == "0.90 (0.50 to 1.10)"
    assert cells[3] == "1.00 (0.90 to 1.10)"
    assert cells[7] == "0.26 (0.16 to 0.36)"  # together, in each round
    assert cells[9] == "0.50 (0.50 to 0.50)"


def test_a_busy_process_has_computed_and_a_sleeping_one_has_not() -> None:
    with Terminal([sys.executable, "-c", "while True: pass"]) as busy, Terminal(["sleep", "60"]) as idle:
        until(lambda: processor_time(busy.pid) > 0.1)
        assert processor_time(idle.pid) < 0.1


def test_what_a_program_has_started_counts_with_it() -> None:
    program = "import subprocess, sys; subprocess.run([sys.executable, '-c', 'while True: pass'])"
    with Terminal([sys.executable, "-c", program]) as parent:
        until(lambda: family_time(parent.pid) > 0.5)
        assert processor_time(parent.pid) < 0.25


def test_a_program_in_a_terminal_draws_and_its_end_is_told_with_its_last_words() -> None:
    program = "import os, sys; print(os.get_terminal_size(), sys.stdin.isatty()); sys.exit(3)"
    with Terminal([sys.executable, "-c", program]) as terminal:

        def ended() -> bool:
            try:
                terminal.check()
            except RuntimeError as error:
                return "columns=120, lines=40) True" in str(error)
            return False

        until(ended)
        assert terminal.drawn > 0


def test_the_program_that_looks_at_the_page_is_a_client_that_answers_at_once() -> None:
    viser = pytest.importorskip("viser", reason="viser is not installed: pip install -e '.[view]'")
    server = viser.ViserServer(host="127.0.0.1", port=free_port(), verbose=False)
    try:
        with Looker(PAGE, server.get_port()) as looker:
            until(looker.sees)
            until(server.get_clients)
            (client,) = server.get_clients().values()
            assert client.local_storage.get_item("pace", timeout=PATIENCE) is None
            server.scene.add_frame("/something")
            server.flush()
            seen = looker.end()
        assert seen["page: frames [1/s]"] > 0.0 and seen["page: changes [1/s]"] > seen["page: frames [1/s]"]
    finally:
        server.stop()


def test_a_program_that_looks_and_cannot_go_on_is_told_of() -> None:
    viser = pytest.importorskip("viser", reason="viser is not installed: pip install -e '.[view]'")
    server = viser.ViserServer(host="127.0.0.1", port=free_port(), verbose=False)
    with Looker(PAGE, server.get_port()) as looker:
        until(looker.sees)
        server.stop()

        def told() -> bool:
            try:
                looker.sees()
            except RuntimeError as error:
                return "looks (page) has ended" in str(error)
            return False

        until(told)
