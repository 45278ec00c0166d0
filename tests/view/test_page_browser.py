"""The page in a real browser: over a recording, and over a running user input that its buttons command."""

from __future__ import annotations

import math
import re
import socket
import statistics
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from browser import MARKS, PATIENCE
from ports import free_port
from rclpy.node import Node

from tulip_msgs.msg import UserCommand
from tulip_ros import topics
from tulip_ros.launch import Launcher
from tulip_ros.log_file import Log
from tulip_ros.plan import make_plan
from tulip_ros.run import session
from tulip_ros.time import stamp_of
from tulip_view.live.steer_panel import RELEASE, STOP

pytest.importorskip("viser", reason="viser is not installed: pip install -e '.[view]'")
pytestmark = MARKS

WALK = Path(__file__).parent.parent / "data" / "recordings" / "walk"
PRESSES = 5
SOON = 0.2  # [s] within which limp must be on its topic


class Opened:
    """The page of a view in the browser, and what went wrong in it."""

    def __init__(self, browser: Any, port: int) -> None:
        self.page = browser.new_page(viewport={"width": 1400, "height": 800})
        self.page.set_default_timeout(PATIENCE)
        self.errors: list[str] = []
        self.strange: list[str] = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("request", lambda request: self._note(request.url, port))
        self.page.goto(f"http://127.0.0.1:{port}")
        self.page.get_by_text(re.compile(r"time \d")).wait_for()

    def _note(self, url: str, port: int) -> None:
        if not url.startswith((f"http://127.0.0.1:{port}", "data:", "blob:")):
            self.strange.append(url)

    def status(self) -> tuple[float, ...]:
        """Return time [s], x, y [m] and yaw [deg] as the page tells them."""
        words = self.page.get_by_text(re.compile(r"time \d")).inner_text()
        found = re.search(r"time ([-\d.]+) s · x ([-\d.]+) m, y ([-\d.]+) m, yaw ([-\d.]+)°", words)
        assert found, words
        return tuple(float(each) for each in found.groups())

    def go_to(self, seconds: float) -> None:
        """Type an instant into the field beside the slider, and wait until the page shows it."""
        field = self.page.locator("input.mantine-NumberInput-input").first
        field.fill(f"{seconds:g}")
        field.press("Enter")
        self.page.get_by_text(f"time {seconds:.2f} s").wait_for()
        self.page.wait_for_timeout(1000)  # the 3D scene follows

    def scene(self, path: Path) -> np.ndarray:
        """Return a picture of the 3D scene between the panels."""
        self.page.screenshot(path=str(path))
        found = cv2.imread(str(path))
        assert found is not None
        return found[150:, 310:1000].astype(int)


@contextmanager
def recording_page() -> Iterator[int]:
    from tulip_view.live.view_log import show_recording

    port, ready, stop = free_port(), threading.Event(), threading.Event()
    serving = threading.Thread(target=show_recording, args=(WALK, None, port, False, ready.set, stop))
    serving.start()
    try:
        assert ready.wait(60.0)
        yield port
    finally:
        stop.set()
        serving.join()


def test_the_slider_of_a_recording_moves_the_robot_to_where_it_truly_was(browser: Any, pictures: Path):
    with Log(WALK) as log:
        begin = log.span[0]
        truths = {
            seconds: next(log.decode(r) for r in log.records(["/ground_truth"], begin + int((seconds - 0.06) * 1e9)))
            for seconds in (2.0, 18.0)
        }
    with recording_page() as port:
        opened = Opened(browser, port)
        seen = []
        for seconds, truth in truths.items():
            opened.go_to(seconds)
            told, x, y, _ = opened.status()
            assert told == pytest.approx(seconds, abs=0.021)
            assert math.hypot(x - truth.robot.position.x, y - truth.robot.position.y) < 0.1
            seen.append(opened.scene(pictures / f"view_{seconds:.0f}.png"))
        moved = np.abs(seen[0] - seen[1]).max(axis=2) > 40
        assert moved.sum() > 1000  # [px] it is elsewhere in the picture
        green = (seen[0][:, :, 1] > seen[0][:, :, 2] + 30).mean()
        assert green > 0.2  # the carpet
        first = opened.status()
        opened.page.get_by_role("button", name="Play").click()
        opened.page.get_by_text(f"time {19.98:.2f} s").wait_for()  # it runs to the end
        assert opened.status()[0] > first[0]
        opened.page.get_by_role("button", name="Play").wait_for()  # and offers to play again
        for tab in ("Joints", "Error", "Tree", "Nodes"):
            opened.page.get_by_role("tab", name=tab).click()
            opened.page.wait_for_timeout(700)
            opened.page.screenshot(path=str(pictures / f"view_{tab.lower()}.png"))
        assert opened.errors == [] and opened.strange == []
        opened.page.close()


class Listener(Node):  # type: ignore[misc]
    """Hears what the user wants."""

    def __init__(self) -> None:
        super().__init__("listener")
        self.commands: list[UserCommand] = []
        topics.USER_COMMAND.subscribe_from(self, self.commands.append)

    def hears_views(self) -> bool:
        """Return whether a view listens to the robot."""
        ears = self.get_subscriptions_info_by_topic(f"/{topics.MOTION_STATE.name}")
        return any(ear.node_name == "view_inputs" for ear in ears)


@contextmanager
def running_view(logs: Path) -> Iterator[tuple[int, Listener, Callable[[Callable[[], object]], None]]]:
    """Run user input and a view as processes; yield port, listener, and what waits until something holds."""
    port = free_port()
    plan = [*make_plan(["user_input"], None), *make_plan(["view"], None, values={"view": {"port": port}})]
    with ExitStack() as stack:
        launcher = stack.enter_context(Launcher(plan, logs))
        listener, spin = stack.enter_context(session(Listener, arguments=["test"], handle_signals=False))

        def until(condition: Callable[[], object]) -> None:
            end = time.monotonic() + PATIENCE * 1e-3
            while not condition():
                spin(0.02)
                assert launcher.poll() == []  # nobody died
                assert time.monotonic() < end

        until(lambda: listener.commands and _answers(port))
        yield port, listener, until


def _answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.mark.ros
def test_buttons_command_the_robot_and_a_browser_that_leaves_ends_the_listening(
    browser: Any, pictures: Path, ros_domain: int, tmp_path: Path
):
    with running_view(tmp_path / "logs") as (port, listener, until):
        assert not listener.hears_views()
        page = browser.new_page(viewport={"width": 1400, "height": 800})
        page.set_default_timeout(PATIENCE)
        page.goto(f"http://127.0.0.1:{port}")
        page.get_by_role("button", name=STOP).wait_for()
        until(listener.hears_views)
        page.evaluate(
            """() => document.addEventListener('click', (event) => {
                 window.pressed = performance.timeOrigin + event.timeStamp; }, true)"""
        )

        def press(name: str, request: int) -> float:
            """Press a button; return how long after that the command was stamped [s]."""
            before = len(listener.commands)
            page.get_by_role("button", name=name, exact=True).click()
            until(lambda: len(listener.commands) > before)
            assert listener.commands[-1].request == request
            return stamp_of(listener.commands[-1]) * 1e-9 - page.evaluate("window.pressed") * 1e-3

        assert listener.commands[-1].request == UserCommand.STOP
        press("Start", UserCommand.PLAY)
        delays = []
        for _ in range(PRESSES):
            delays.append(press(STOP, UserCommand.LIMP))
            page.get_by_role("button", name=RELEASE, exact=True).click()
            page.get_by_text("release: taken").wait_for()
            press("Stand", UserCommand.STAND)
            page.get_by_text("stand: taken").wait_for()
        print(f"limp after {', '.join(f'{1000.0 * delay:.0f}' for delay in delays)} ms")
        assert statistics.median(delays) < SOON  # another program on this machine may hold back a single one
        press("Stand", UserCommand.STAND)
        before = len(listener.commands)
        page.keyboard.press("l")  # the answer to the wish may come before it or after it
        until(lambda: len(listener.commands) > before)
        assert listener.commands[-1].request == UserCommand.LIMP
        page.get_by_text("emergency stop: sent").wait_for()
        page.get_by_text("stand: taken").wait_for()
        page.get_by_text("emergency stop by page (key l)").first.wait_for()
        page.screenshot(path=str(pictures / "view_live.png"))
        page.close()
        until(lambda: not listener.hears_views())
        last = listener.commands[-1].request
        assert last == UserCommand.LIMP  # the last wish holds without a page
