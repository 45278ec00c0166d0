"""The page: draws a scene for as long as somebody looks, as often as the browser keeps up."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Sequence
from typing import Protocol

import viser

from tulip_description.field import Field
from tulip_view.live.info_panel import InfoPanel
from tulip_view.live.pace import Pace
from tulip_view.live.scene import Scene
from tulip_view.live.stage import Stage

IDLE = 0.5  # [s] between two looks whether somebody looks
ASK = 1.0  # [s] between two questions to the browsers whether they keep up
ALONE = "(alone)"


class Source(Protocol):
    """Where a scene's messages come from."""

    @property
    def robots(self) -> Sequence[str]:
        """Namespaces of the robots that can be shown."""

    @property
    def robot(self) -> str:
        """The one that is shown."""

    def choose(self, robot: str) -> None:
        """Show another robot."""

    def remarks(self) -> Sequence[str]:
        """Return what it does not give and what the page lacks for that, and whatever else should be said of it."""

    def update(self) -> bool:
        """Feed the scene up to now; return whether it went to another instant at once."""

    def rest(self) -> None:
        """Nobody looks: do as little as possible."""


class Page:
    """Draws."""

    def __init__(self, server: viser.ViserServer, scene: Scene, field: Field, source: Source) -> None:
        """Lay the page out.

        Args:
            server: Its server.
            scene: What there is to see.
            field: The field.
            source: Feeds the scene.
        """
        self._server, self._scene, self._source = server, scene, source
        self._stop = threading.Event()
        self._drawing = threading.Thread(target=self._run, daemon=True)
        self._pace = Pace()
        self._wanted: str | None = None
        server.initial_camera.position = (-2.5, -6.8, 4.6)
        server.initial_camera.look_at = (0.0, 0.3, 0.3)
        self._stage = Stage(server, scene, field)
        self.info = InfoPanel(server, scene, source.remarks)
        gui = server.gui
        self._robots = gui.add_dropdown("robot", (source.robot or ALONE,), order=-1.0)

        @self._robots.on_update
        def _(event: viser.GuiEvent[viser.GuiDropdownHandle[str]]) -> None:
            if event.client is not None:
                self._wanted = "" if self._robots.value == ALONE else self._robots.value

        look = gui.add_button_group("look at", ("field", "robot"), order=-0.5)

        @look.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonGroupHandle]) -> None:
            if event.client is not None:
                self._look(event.client, look.value)

    def open(self) -> None:
        """Begin to draw, in a thread of its own."""
        self._drawing.start()

    def check(self) -> None:
        """Raise an error where drawing has failed, which its thread has told; call it now and then."""
        if not self._drawing.is_alive():
            raise RuntimeError("The page cannot be drawn any more; the error stands above.")

    def close(self) -> None:
        """End drawing."""
        self._stop.set()
        self._drawing.join()

    def _run(self) -> None:
        asker = threading.Thread(target=self._ask, daemon=True)
        asker.start()
        resting = False
        robots_due = 0.0
        drawn: tuple[int, bool] | None = None
        while not self._stop.is_set():
            if not self._server.get_clients():
                if not resting:
                    self._source.rest()
                resting = True
                self._stop.wait(IDLE)
                continue
            resting = False
            begin = time.monotonic()
            if self._wanted is not None:
                self._source.choose(self._wanted)
                self._wanted = None
                self.info.draw_all()
            if begin > robots_due:
                robots_due = begin + ASK
                self._show_robots()
            if self._source.update():
                self.info.draw_all()
            seen = (self._scene.changes, bool(self.info.ghost.value))
            if seen != drawn:
                drawn = seen
                self._stage.draw(seen[1])
            self.info.draw()
            worked = time.monotonic() - begin
            self._pace.worked(worked)
            self._stop.wait(max(self._pace.period - worked, 0.0))
        self._source.rest()
        asker.join()

    def _show_robots(self) -> None:
        names = tuple(robot or ALONE for robot in self._source.robots)
        if names != tuple(self._robots.options):
            self._robots.options = names
            self._robots.value = self._source.robot or ALONE  # type: ignore[misc]  # its setter takes other types

    def _look(self, client: viser.ClientHandle, what: str) -> None:
        body = self._scene.estimate() or self._scene.truth()
        if what == "robot" and body is not None:
            pose = body.footprint
            angle = pose.yaw + math.radians(35.0)
            client.camera.position = (pose.x + 2.2 * math.cos(angle), pose.y + 2.2 * math.sin(angle), 1.1)
            client.camera.look_at = (pose.x, pose.y, 0.5)
        else:
            client.camera.position = self._server.initial_camera.position
            client.camera.look_at = self._server.initial_camera.look_at

    def _ask(self) -> None:
        """Ask the browsers something small once a second: how long the slowest takes to answer sets the pace."""
        while not self._stop.wait(ASK):
            slowest = 0.0
            for client in self._server.get_clients().values():
                begin = time.monotonic()
                try:
                    client.local_storage.get_item("pace", timeout=ASK)
                except (TimeoutError, RuntimeError):  # it is busy, has left, or keeps no storage
                    if client.client_id not in self._server.get_clients():
                        continue
                slowest = max(slowest, time.monotonic() - begin)
            if slowest:
                self._pace.answered(slowest)
