"""What the faces cost a match: page, bridge and menu together, and whether they slow it.

Trials of the same seed follow each other in one run: without faces, and with all three while somebody looks by each:
the page is open, a viewer listens to every topic of the bridge, the menu is in a terminal. The same stretch of play
is measured each time.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from socket import SOCK_STREAM

import numpy as np

from tulip_ros.launch import Launcher
from tulip_ros.plan import make_plan
from tulip_ros.run import session
from tulip_sim.bench.faces_lookers import browser
from tulip_sim.bench.faces_lookers.looker import BRIDGE, BROWSER, PAGE, Looker
from tulip_sim.bench.faces_lookers.terminal import Terminal
from tulip_sim.bench.free_port import free_port, own_domain
from tulip_sim.bench.processor_time import family_time
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.match_graph import SILENCE, TrialWatcher, trial_plan

ROUNDS = 3
BEGIN, WATCHED = 1.0, 20.0  # [s] of play before it is measured, and while it is; a goal ends it sooner
SHARE = 1 / 3  # of a core, asked for
FACES = ("view", "bridge", "menu")
WITHOUT, PROGRAM, CHROMIUM = "without", "program", "browser"
WAYS = {
    WITHOUT: "without faces",
    PROGRAM: "with; a program takes what the page sends",
    CHROMIUM: "with; Chromium draws the page, without a graphics card",
}
LOOKING = {PROGRAM: PAGE, CHROMIUM: BROWSER}
"""Who looks by the page in each way."""
MENU = Path(__file__).parents[2] / "scripts" / "menu.py"
FACTOR, ROBOT, PLAYED = "real-time factor", "robot and simulator [core]", "played [s]"


def measure(number: int) -> Row:
    """Play one trial in each way, one after the other, each round beginning with another.

    Raises:
        RuntimeError: if a face ends, nothing can be seen by it, or the simulator falls silent.
    """
    own_domain()
    ways = [way for way in WAYS if way != CHROMIUM or browser.executable()]
    row: Row = {"round": number}
    for index in range(len(ways)):
        way = ways[(number + index) % len(ways)]
        row |= {f"{way}: {name}": value for name, value in play(number, way).items()}
    return row


def play(seed: int, way: str) -> Row:
    """Play one trial and return its figures.

    Args:
        seed: Of the trial.
        way: One of `WAYS`.

    Raises:
        RuntimeError: as for `measure`.
    """
    with ExitStack() as stack:
        processes: list[Launcher] = []
        lookers: list[Looker] = []
        if way != WITHOUT:
            ports = {"view": free_port(SOCK_STREAM), "bridge": free_port(SOCK_STREAM)}
            values = {name: {"port": port} for name, port in ports.items()}
            processes.append(stack.enter_context(Launcher(make_plan(list(ports), values=values, driver=None))))
            for kind, face in ((LOOKING[way], "view"), (BRIDGE, "bridge")):
                lookers.append(stack.enter_context(Looker(kind, ports[face])))
        processes.append(stack.enter_context(Launcher(trial_plan(seed, referee_port=free_port()))))
        watcher, spin = stack.enter_context(session(TrialWatcher, arguments=[], handle_signals=False))
        menu: Terminal | None = None

        def wait(holds: Callable[[], bool]) -> None:
            while not holds():
                spin(0.05)
                said = [line for launcher in processes for line in launcher.poll()]
                if said or time.monotonic() - watcher.heard > SILENCE:
                    raise RuntimeError(f"{said or 'the simulator is silent'}; see {processes[-1].log_folder}")
                if menu is not None:
                    menu.check()

        wait(lambda: watcher.truth is not None)  # so the robot's nodes are there, which the menu wants
        if way != WITHOUT:
            menu = stack.enter_context(Terminal([sys.executable, str(MENU)]))
        wait(lambda: all(looker.sees() for looker in lookers) and (menu is None or menu.drawn > 0))
        wait(lambda: _played(watcher) > BEGIN)
        nodes = {state.name: state.pid for launcher in processes for state in launcher.states()}
        others = {looker.kind: looker.pid for looker in lookers}
        if menu is not None:
            others["menu"] = menu.pid
        pids = nodes | others
        first, begun, before = watcher.stamp, time.monotonic(), _times(pids)
        wait(lambda: watcher.stamp - first > WATCHED * 1e9 or _is_over(watcher))
        spent, elapsed = {name: after - before[name] for name, after in _times(pids).items()}, time.monotonic() - begun
        played = (watcher.stamp - first) * 1e-9
        row: Row = {FACTOR: round(played / elapsed, 3), PLAYED: round(played, 1)}
        row[ROBOT] = round(sum(spent[name] for name in nodes if name not in FACES) / elapsed, 4)
        row |= {f"{name} [core]": round(spent[name] / elapsed, 4) for name in pids if name in FACES or name in others}
        for looker in lookers:
            row |= looker.end()
        return row


def _played(watcher: TrialWatcher) -> float:
    return float(watcher.truth.trial_time) if watcher.truth is not None else 0.0


def _is_over(watcher: TrialWatcher) -> bool:
    return watcher.truth is not None and bool(watcher.truth.outcome)


def _times(pids: Mapping[str, int]) -> dict[str, float]:
    return {name: family_time(pid) for name, pid in pids.items()}


def summarize(rows: list[Row]) -> list[str]:
    """Return what each way costs, and how fast the match then goes."""
    lines = [
        f"A trial with camera, {WATCHED:.0f} s of play, the same seed in each way, one after the other on this machine,"
        f" {len(rows)} rounds: medians (least to greatest). The ways with faces have all three, and they are used: the"
        " page is open in a browser, or in a program that takes all that it sends and answers at once, as the browser"
        " of a fast machine does; a viewer listens to every topic of the bridge, raw pictures included; the menu is in"
        f" a terminal. Asked for: the three together {SHARE:.0%} of a core at most, and no match slowed. Browser,"
        " viewer and terminal are not counted, but take their part of the same cores (`who looks`: browser or program,"
        " and viewer). `robot and simulator` tells what the faces have the other nodes do: those compress and send"
        " pictures only while someone listens. All but the factors in cores.",
        "",
        "| way | real-time factor | of that without | view | bridge | menu | together | robot and simulator"
        " | who looks |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for way, words in WAYS.items():
        of_way = [row for row in rows if f"{way}: {FACTOR}" in row]
        if not of_way:
            continue

        def figures(name: str, way: str = way, of_way: list[Row] = of_way) -> np.ndarray:
            return np.array([row[f"{way}: {name}"] for row in of_way])

        def together(names: Sequence[str], figures: Callable[[str], np.ndarray] = figures) -> str:
            return _told(np.sum([figures(f"{name} [core]") for name in names], axis=0))

        factors = figures(FACTOR)
        ratios = factors / np.array([row[f"{WITHOUT}: {FACTOR}"] for row in of_way])
        cells = [words, _told(factors), "" if way == WITHOUT else _told(ratios)]
        if way == WITHOUT:
            cells += ["", "", "", "", _told(figures(ROBOT)), ""]
        else:
            cells += [together([name]) for name in FACES]
            cells += [together(FACES), _told(figures(ROBOT)), together((LOOKING[way], BRIDGE))]
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _told(values: np.ndarray) -> str:
    return f"{np.median(values):.2f} ({values.min():.2f} to {values.max():.2f})"


BENCH = Bench(
    "faces", "View, bridge and menu", [(number,) for number in range(1, ROUNDS + 1)], measure, summarize, workers=1
)
