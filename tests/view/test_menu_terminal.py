"""The menu as people start it, in a real terminal that tmux keeps, beside a real node."""

from __future__ import annotations

import os
import shlex
import shutil
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from rclpy.node import Node

from tulip_msgs.msg import UserCommand
from tulip_ros import topics
from tulip_ros.launch import Launcher
from tulip_ros.plan import make_plan
from tulip_ros.run import session
from tulip_ros.time import stamp_of

TMUX = shutil.which("tmux")
pytestmark = [
    pytest.mark.ros,
    pytest.mark.skipif(TMUX is None, reason="no tmux on the PATH: sudo apt-get install tmux"),
    pytest.mark.usefixtures("ros_domain"),
]

MENU = Path(__file__).parents[2] / "scripts" / "menu.py"
PATIENCE = 120.0  # [s] for a machine that is busy with other things
PRESSES = 5
SOON = 0.2  # [s] within which limp must be on its topic


class Terminal:
    """A terminal of 80 by 24 in which the menu runs, on a tmux server of its own."""

    def __init__(self, folder: Path, environment: str) -> None:
        self._socket = str(folder / "tmux")
        command = f"{environment} {shlex.join([sys.executable, str(MENU)])}; echo menu ended with $?; exec cat"
        self.tmux("-f", os.devnull, "new-session", "-d", "-x", "80", "-y", "24", command)

    def tmux(self, *arguments: str) -> str:
        assert TMUX is not None
        return subprocess.run([TMUX, "-S", self._socket, *arguments], check=True, capture_output=True, text=True).stdout

    def press(self, *keys: str) -> None:
        self.tmux("send-keys", *keys)

    @property
    def text(self) -> str:
        return " ".join(self.tmux("capture-pane", "-p").split())


class Robot(Node):  # type: ignore[misc]
    """Hears what the user wants."""

    def __init__(self) -> None:
        super().__init__("robot")
        self.commands: list[UserCommand] = []
        topics.USER_COMMAND.subscribe_from(self, self.commands.append, depth=50)  # none is missed


@contextmanager
def menu_in_terminal(
    folder: Path, environment: str = ""
) -> Iterator[tuple[Terminal, Robot, Callable[[Callable[[], object]], None]]]:
    """Yield the terminal, the robot, and what waits until something holds; end all of it."""
    with (
        Launcher(make_plan(["user_input"], None), folder / "logs"),
        session(Robot, ["test"], handle_signals=False) as (robot, spin),
    ):
        terminal = Terminal(folder, f"TULIP_NO_VENV=1 {environment}")

        def until(holds: Callable[[], object]) -> None:
            end = time.monotonic() + PATIENCE
            while not holds():
                spin(0.02)
                assert time.monotonic() < end, terminal.text

        try:
            until(lambda: robot.commands and "wish stop" in terminal.text)
            until(lambda: "does not run" not in terminal.text)
            yield terminal, robot, until
        finally:
            terminal.tmux("kill-server")


def test_keys_change_the_topic_the_screen_shows_it_and_limp_is_there_soon(tmp_path: Path):
    with menu_in_terminal(tmp_path) as (terminal, robot, until):
        terminal.press("w")
        until(lambda: robot.commands[-1].request == UserCommand.WALK_TEST)
        terminal.press("Up", "Up", "e")
        until(lambda: list(robot.commands[-1].velocity) == [0.1, 0.0, -0.1])
        until(lambda: "walk forward +0.10" in terminal.text and "walk test: taken" in terminal.text)
        delays = []
        for number in range(PRESSES):
            terminal.press("c" if number % 2 else "p")
            until(lambda: "Esc leaves" in terminal.text)
            before, pressed = len(robot.commands), time.time_ns()
            terminal.press("l")
            until(lambda before=before: len(robot.commands) > before)
            assert robot.commands[-1].request == UserCommand.LIMP
            delays.append((stamp_of(robot.commands[-1]) - pressed) * 1e-9)
            until(lambda: "wish LIMP" in terminal.text and "Esc leaves" not in terminal.text)
            terminal.press("o")
            until(lambda: "release: taken" in terminal.text and "o releases it" not in terminal.text)
            terminal.press("u")
            until(lambda: "wish stand" in terminal.text)
        print(f"limp after {', '.join(f'{1000.0 * delay:.0f}' for delay in delays)} ms")
        assert statistics.median(delays) < SOON  # another program on this machine may hold back a single one
        terminal.press("w", *["Up"] * 10, "l", *["Up"] * 5)  # all at once, as from a key that is held down
        until(lambda: robot.commands[-1].request == UserCommand.LIMP)
        limp = len(robot.commands)
        terminal.press("o")
        until(lambda: "o releases it" not in terminal.text)
        terminal.press("w")
        until(lambda: "walk forward +0.00" in terminal.text)
        terminal.press("Up")
        until(lambda: list(robot.commands[-1].velocity) == [0.05, 0.0, 0.0])
        after = [each.velocity[0] for each in robot.commands[limp:]]
        assert after == [0.0, 0.05] and robot.commands[limp].request == UserCommand.WALK_TEST
        terminal.press("u")
        until(lambda: "wish stand" in terminal.text)
        terminal.press("C-q")
        until(lambda: "menu ended with 0" in terminal.text)
        assert robot.commands[-1].request == UserCommand.STAND  # the last wish holds without a menu


def test_a_terminal_without_colours_says_the_same(tmp_path: Path):
    with menu_in_terminal(tmp_path, "NO_COLOR=1 TERM=vt100") as (terminal, robot, until):
        terminal.press("k", "2")
        until(lambda: robot.commands[-1].argument == "right")
        until(lambda: "wish kick test right" in terminal.text and "kick test: taken" in terminal.text)
        until(lambda: "user_input ok" in terminal.text)
        terminal.press("C-c")
        until(lambda: "menu ended with 0" in terminal.text)


def test_unusable_namespace_is_refused_in_words():
    ended = subprocess.run(
        [sys.executable, str(MENU), "--namespace", "my robot"],
        env={**os.environ, "TULIP_NO_VENV": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 2 and "my robot" in ended.stderr and "Traceback" not in ended.stderr
