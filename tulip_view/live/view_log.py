"""The page of a recording."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_ros.log_file import Log
from tulip_view.live.log_feed import LogFeed
from tulip_view.live.page import Page
from tulip_view.live.scene import Scene
from tulip_view.live.server import open_server
from tulip_view.live.time_panel import TimePanel

LOOK = 0.5  # [s] between two looks whether the page is still drawn


def show_recording(
    path: Path, robot: str | None, port: int, lan: bool, ready: Callable[[], None], stop: threading.Event
) -> None:
    """Serve the page of a recording until it is told to stop.

    Args:
        path: The recording.
        robot: Namespace of the robot to begin with; None for the striker or the only one.
        port: TCP port of the page.
        lan: Other computers may open the page, too.
        ready: Called once the page can be opened.
        stop: Set to stop.

    Raises:
        BadInputError: if the recording cannot be read, holds no such robot, or the port is taken.
    """
    with Log(path) as log:
        scene = Scene(load_robot())
        feed = LogFeed(log, scene, robot)
        server = open_server(port, lan)
        try:
            page = Page(server, scene, load_field(), TimePanel(server, feed))
            page.open()
            ready()
            try:
                while not stop.wait(LOOK):
                    page.check()
            finally:
                page.close()
        finally:
            server.stop()
