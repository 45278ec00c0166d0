"""A viewer that nobody here wrote shows a live match through the bridge, by the layout of this repository.

It is not downloaded by itself: `npm install --ignore-scripts` in tests/view/foxglove_page brings it (180 MB).
"""

from __future__ import annotations

import functools
import http.server
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from browser import MARKS, PATIENCE
from ports import free_port

import tulip_view.bridge
from tulip_ros.launch import Launcher
from tulip_ros.nodes import find_node
from tulip_ros.plan import Start
from tulip_sim.match_graph import trial_plan

PAGE = Path(__file__).with_name("foxglove_page")
LIBRARY = PAGE / "node_modules"
FILES = {
    "/": PAGE / "index.html",
    "/layout.json": Path(tulip_view.bridge.__file__).with_name("tulip.foxglove.json"),
}
SOON = {"initial_time": 0.5, "ready_time": 0.5, "set_time": 1.0}
"""Times of the referee [s]: play begins soon."""

pytestmark = [
    *MARKS,
    pytest.mark.ros,
    pytest.mark.sim,
    pytest.mark.slow,
    pytest.mark.skipif(not LIBRARY.exists(), reason=f"run `npm install --ignore-scripts` in {PAGE.name}"),
]


class Files(http.server.SimpleHTTPRequestHandler):
    """Serves the page, the layout and the viewer's library."""

    def translate_path(self, path: str) -> str:
        plain = path.partition("?")[0]
        return str(FILES.get(plain) or super().translate_path(path))

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture
def page_address() -> Iterator[str]:
    handler = functools.partial(Files, directory=str(LIBRARY))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://localhost:{server.server_port}"
        server.shutdown()


@pytest.fixture
def bridge_port(ros_domain: int, tmp_path: Path) -> Iterator[int]:
    """A trial with the bridge."""
    port = free_port()
    nodes = trial_plan(1, values={"driver": {"rules": SOON}}, referee_port=free_port())
    bridge = Start("bridge", find_node("bridge"), {"port": port}, "")
    with Launcher((*nodes, bridge), tmp_path / "logs") as launcher:
        yield port
        assert launcher.poll() == []


def canvases(page: Any) -> list[np.ndarray]:
    """Return what is drawn now, the largest first, as BGR."""
    picture = cv2.imdecode(np.frombuffer(page.screenshot(), np.uint8), cv2.IMREAD_COLOR)
    places = page.locator("canvas").evaluate_all(
        "all => all.map(e => e.getBoundingClientRect()).map(r => [r.x, r.y, r.right, r.bottom].map(Math.round))"
    )
    crops = [picture[top:bottom, left:right] for left, top, right, bottom in places]
    return sorted(crops, key=lambda crop: -crop.size)


def share(crop: np.ndarray, low: tuple[int, int, int], high: tuple[int, int, int]) -> float:
    """Return the share of pixels with hue [0..179], saturation and value [0..255] between two bounds."""
    return float(cv2.inRange(cv2.cvtColor(crop, cv2.COLOR_BGR2HSV), low, high).mean() / 255)


def until(what: str, holds: Callable[[], Any]) -> None:
    deadline = time.monotonic() + PATIENCE / 1000
    while not holds():
        assert time.monotonic() < deadline, f"{what} did not come to show"
        time.sleep(1.0)


def test_robot_curves_camera_and_health_show(browser: Any, pictures: Path, page_address: str, bridge_port: int):
    page = browser.new_page(viewport={"width": 1500, "height": 860})
    page.set_default_timeout(PATIENCE)
    page.goto(f"{page_address}/?ds=foxglove-websocket&ds.url=ws://localhost:{bridge_port}&layoutId=tulip")
    for node in ("driver", "vision", "worldmodel", "motion", "strategy"):
        page.get_by_text(f"/: {node}").wait_for()
    page.get_by_text("running").first.wait_for()
    page.get_by_text("Open settings to configure").locator("..").get_by_role("button").click()
    page.mouse.click(24, 24)  # the list of topics makes room
    black = ((0, 0, 1), (179, 255, 70))  # feet, hips, chest: no more than these are so dark
    turf = ((40, 80, 40), (75, 255, 255))
    curve = ((95, 120, 100), (115, 255, 255))  # blue, the first of each plot
    until("robot", lambda: share(canvases(page)[0], *black) > 0.002)
    until("picture", lambda: any(share(crop, *turf) > 0.1 for crop in canvases(page)[1:]))
    until("curves", lambda: sum(share(crop, *curve) > 0.001 for crop in canvases(page)) >= 3)
    before = canvases(page)[0]
    until("walking", lambda: np.mean(np.any(canvases(page)[0] != before, axis=2)) > 0.02)
    page.screenshot(path=pictures / "foxglove.png")
