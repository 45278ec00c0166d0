"""Node "view": the page of a running robot."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

from rclpy.node import Node

from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_ros.asking import Asker
from tulip_ros.priority import give_way
from tulip_ros.run import ComponentNode, run
from tulip_view.live.beside import PORT
from tulip_view.live.live_feed import PICTURES, LiveFeed
from tulip_view.live.page import Page
from tulip_view.live.scene import Scene
from tulip_view.live.server import open_server
from tulip_view.live.steer_panel import SteerPanel
from tulip_view.user_calls import UserCalls

LOOK = 0.2  # [s] longest wait between two looks at the page


@dataclass(frozen=True)
class ViewParameters:
    """Where the page is, and what it shows.

    Attributes:
        port: TCP port of the page.
        lan: Other computers may open the page, too, and command the robot by it.
        robot: Namespace of the robot to begin with; "" for the node's own, or the first there is.
    """

    port: int = PORT
    lan: bool = False
    robot: str = ""

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not usable.
        """
        if not 0 < self.port < 2**16:
            raise ValueError(f"port is {self.port}; expected 1 to 65535")


class ViewNode(ComponentNode):
    """Serves the page: one thread draws it, the node's own handles the answers of services."""

    def __init__(self, settings: ViewParameters | None = None) -> None:
        """Open the page.

        Args:
            settings: Values to start from; ROS parameters replace them.

        Raises:
            BadInputError: if the port is taken.
        """
        super().__init__("view")
        self.settings = p = self.load(settings or ViewParameters())
        self._server = open_server(p.port, p.lan)
        self._scene = Scene(load_robot())
        # What is polled must be on a node that no executor serves; both share one participant of the middleware.
        self._ears = Node("view_inputs", enable_rosout=False, start_parameter_services=False)
        self._feed = LiveFeed(self._ears, self._scene, (p.robot or self.get_namespace()).strip("/"))
        self._asker = Asker(self)
        self._calls: dict[str, UserCalls] = {}
        self._calls_lock = threading.Lock()
        self._steer = SteerPanel(self._server, self._current_calls, self._heading)
        self._page = Page(self._server, self._scene, load_field(), self._feed)
        sources = self._page.info.sources
        sources.options, sources.visible = tuple(PICTURES), True
        sources.on_update(lambda _: self._feed.choose_picture(sources.value))
        self._page.open()

    def advance(self, spin: Callable[[float], None]) -> None:
        """Handle answers."""
        spin(LOOK)
        self._page.check()
        self._current_calls()  # before a button is pressed: finding a service takes a moment

    def destroy_node(self) -> None:
        """Close the page, and end."""
        self._page.close()
        self._server.stop()
        self._ears.destroy_node()
        super().destroy_node()

    def _current_calls(self) -> UserCalls:
        robot = self._feed.robot
        with self._calls_lock:
            if robot not in self._calls:
                self._calls[robot] = UserCalls(
                    self, self._asker, "page", robot, self._steer.tell, lambda: bool(self._server.get_clients())
                )
            return self._calls[robot]

    def _heading(self) -> float:
        pose = self._scene.around().pose
        return pose.yaw if pose is not None else 0.0


if __name__ == "__main__":
    give_way()
    run(ViewNode, ViewNode.advance)
