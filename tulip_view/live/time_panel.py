"""The page's left side over a recording: a slider for the time, play and pause, speed."""

from __future__ import annotations

import time
from html import escape

import viser

from tulip_ros.errors import BadInputError
from tulip_view.live.info_panel import STYLE
from tulip_view.live.log_feed import LogFeed

SPEEDS = {"1/4": 0.25, "1/2": 0.5, "1": 1.0, "2": 2.0, "4": 4.0}
STEP = 0.02  # [s] of the slider
LONGEST = 0.5  # [s] of wall-clock time that one drawing may let pass: after a pause of the page it goes on, not ahead


class TimePanel:
    """Moves a recording's position as its user wishes."""

    def __init__(self, server: viser.ViserServer, feed: LogFeed) -> None:
        """Add it.

        Args:
            server: Of the page.
            feed: The recording.
        """
        self._feed = feed
        self._playing = False
        self._wanted: float | None = None
        self._last = time.monotonic()
        gui = server.gui
        panel = gui.add_panel()
        with panel.add_tab("Recording"):
            self._slider = gui.add_slider("time [s]", 0.0, max(round(feed.duration, 3), STEP), STEP, 0.0)
            self._button = gui.add_button("Play")
            self._note = gui.add_html("")
            self._speed = gui.add_dropdown("speed", tuple(SPEEDS), initial_value="1")
        panel.dock_left()
        panel.set_width(300)

        @self._slider.on_update
        def _(event: viser.GuiEvent[viser.GuiSliderHandle[float]]) -> None:
            if event.client is not None:  # else it was this program, which shows how far it is
                self._wanted = float(self._slider.value)

        @self._button.on_click
        def _(event: object) -> None:
            if not self._playing and feed.ended:
                self._wanted = 0.0
            self._play(not self._playing)

    @property
    def robots(self) -> tuple[str, ...]:
        """Namespaces of the robots in the recording."""
        return self._feed.robots

    @property
    def robot(self) -> str:
        """The one that is shown."""
        return self._feed.robot

    def remarks(self) -> list[str]:
        """Return what is not shown and why, in sentences."""
        return self._feed.remarks()

    def choose(self, robot: str) -> None:
        """Show another robot, at the same instant."""
        self._feed.choose(robot)

    def update(self) -> bool:
        """Go where the user wants to be, or on; return whether it went to another instant."""
        now = time.monotonic()
        elapsed, self._last = min(now - self._last, LONGEST), now
        wanted, self._wanted = self._wanted, None
        try:
            if wanted is not None:
                self._feed.seek(wanted)
            elif self._playing:
                self._feed.advance(elapsed * SPEEDS[self._speed.value])
        except BadInputError as error:  # damage that lies inside a file shows only when one comes there
            self._note.content = STYLE.format(f"<b>{escape(str(error))}</b>")
            self._play(False)
        if wanted is None and self._playing:
            self._slider.value = round(self._feed.position, 3)  # type: ignore[misc]  # its setter takes other types
            if self._feed.ended:
                self._play(False)
        return wanted is not None

    def rest(self) -> None:
        """Hold: nobody looks."""
        if self._playing:
            self._play(False)

    def _play(self, playing: bool) -> None:
        self._playing = playing
        self._button.label = "Pause" if playing else "Play"
