"""The report's page in a real browser: it opens from disk without a network, shows all sections, and replays."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from browser import MARKS, PATIENCE
from recordings_to_view import play

from tulip_ros.log_file import Log
from tulip_view.report.build import make_report
from tulip_view.report.page import make_page

pytestmark = [*MARKS, pytest.mark.sim]

SECTIONS = ["happened", "replay", "fieldpaths", "errors", "stills", "balance", "joints", "timing", "about"]


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("browser")
    with Log(play(folder / "trial", 1.3)) as log:
        (folder / "report.html").write_text(make_page(make_report(log, "", lambda number: None)), encoding="utf-8")
    return folder / "report.html"


class Opened:
    """The page, and what it said and asked for while it was open."""

    def __init__(self, browser: Any, file: Path, width: int) -> None:
        self.page = browser.new_page(viewport={"width": width, "height": 900})
        self.page.set_default_timeout(PATIENCE)
        self.errors: list[str] = []
        self.requests: list[str] = []
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on("console", lambda said: said.type == "error" and self.errors.append(said.text))
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.context.set_offline(True)
        self.page.goto(file.as_uri())
        self.page.wait_for_function("player !== null")

    def robot(self) -> np.ndarray:
        """Return (n, 3) corners of the robot's boxes, as the scene draws them now [m]."""
        script = """() => { const mesh = scene.data.find((trace) => trace.type === 'mesh3d' && trace.facecolor);
            return [mesh.x, mesh.y, mesh.z].map((axis) => Array.from(axis)); }"""
        return np.array(self.page.evaluate(script), dtype=float).T

    def picture(self, selector: str, path: Path) -> np.ndarray:
        self.page.locator(selector).screenshot(path=str(path))
        found = cv2.imread(str(path))
        assert found is not None
        return found

    def show(self, frame: int) -> None:
        """Move the slider, as a hand does it, and wait until the scene has followed."""
        self.page.evaluate(
            """(frame) => { const slider = document.getElementById('slider'); slider.value = frame;
               slider.dispatchEvent(new Event('input')); }""",
            frame,
        )
        self.page.wait_for_timeout(700)


@pytest.fixture(scope="module")
def opened(browser: Any, file: Path) -> Iterator[Opened]:
    found = Opened(browser, file, 1280)
    yield found
    found.page.close()


def test_the_page_shows_every_section_and_draws_every_figure(opened: Opened, pictures: Path):
    sections = opened.page.evaluate("[...document.querySelectorAll('section')].map((each) => each.id)")
    assert sections == SECTIONS
    for name in sections:
        opened.page.evaluate("(name) => document.getElementById(name).scrollIntoView()", name)
        opened.page.wait_for_function(
            "(name) => [...document.querySelectorAll(`#${name} .plot`)].every((plot) => plot.dataset.drawn)", arg=name
        )
        picture = opened.picture(f"section#{name}", pictures / f"{name}.png")
        assert picture.std() > 5.0, name  # not one colour
    pieces = opened.page.evaluate(
        "[...document.querySelectorAll('.plot')].map((plot) => [plot.id, plot.querySelectorAll('.trace').length])"
    )
    assert pieces and all(count > 0 for _, count in pieces), pieces


def test_the_page_asks_for_nothing_but_itself_and_reports_no_error(opened: Opened, file: Path):
    assert [request for request in opened.requests if not request.startswith(("data:", "blob:"))] == [file.as_uri()]
    assert opened.errors == []


def test_the_replay_begins_with_the_robot_in_the_picture(opened: Opened, pictures: Path):
    opened.page.evaluate("document.getElementById('replay').scrollIntoView()")
    opened.show(0)
    corners = opened.robot()
    assert np.isfinite(corners).all() and 1.0 < np.ptp(corners[:, 2]) < 1.6  # it stands
    seen = opened.picture("#stage", pictures / "scene.png")
    height, width = seen.shape[:2]
    middle = seen[height // 4 : 3 * height // 4, 2 * width // 5 : 3 * width // 5].astype(int)
    grey = np.ptp(middle, axis=2) < 30  # the robot's boxes are grey and black, all else has a colour
    assert grey.mean() > 0.15


def test_the_robot_moves_when_the_slider_moves(opened: Opened, pictures: Path):
    opened.page.evaluate("document.getElementById('replay').scrollIntoView()")
    last = int(opened.page.evaluate("Number(document.getElementById('slider').max)"))
    opened.show(0)
    corners, picture = opened.robot(), opened.picture("#stage", pictures / "first.png")
    opened.show(last)
    assert opened.page.evaluate("now") == pytest.approx(1.3, abs=0.1)
    moved = np.abs(opened.robot() - corners).max()
    assert moved > 0.002  # [m] it sways, and turns its head
    assert np.abs(opened.picture("#stage", pictures / "last.png").astype(int) - picture).max() > 30
    opened.show(0)
    assert opened.robot() == pytest.approx(corners, abs=1e-6)


def test_play_runs_through_the_recording(opened: Opened):
    opened.show(0)
    opened.page.click("#play")
    opened.page.wait_for_function("document.getElementById('play').textContent === 'Play' && now > 1.0")
    slider = "document.getElementById('slider')"
    assert opened.page.evaluate(f"{slider}.value === {slider}.max")


def test_a_click_on_an_event_sets_the_time(opened: Opened):
    row = opened.page.locator("tr[data-time]").last
    row.click()
    assert opened.page.evaluate("now") == pytest.approx(float(row.get_attribute("data-time")), abs=1e-6)


def test_the_chosen_joint_is_the_one_that_is_shown(opened: Opened):
    opened.page.evaluate("document.getElementById('joints').scrollIntoView()")
    opened.page.select_option("select.choice", "right knee")
    opened.page.wait_for_timeout(500)
    shown = opened.page.evaluate(
        """document.getElementById('figure-jointangle').data.filter((trace) => trace.visible !== false)
           .map((trace) => trace.meta)"""
    )
    assert shown and set(shown) == {"right knee"}


def test_nothing_is_wider_than_a_narrow_window(browser: Any, file: Path, pictures: Path):
    narrow = Opened(browser, file, 480)
    try:
        assert narrow.page.evaluate("document.documentElement.scrollWidth") <= 480
        narrow.page.screenshot(path=str(pictures / "narrow.png"))
    finally:
        narrow.page.close()
