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
            source = TimePanel(server, feed)
            page = Page(server, scene, load_field(), source)
            drawing = threading.Thread(target=page.run)
            drawing.start()
            ready()
            try:
                stop.wait()
            finally:
                page.stop()
                drawing.join()
        finally:
            server.stop()
