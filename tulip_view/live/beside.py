"""The page beside other nodes: as one more process of a launcher. Without the page's own library."""

from __future__ import annotations

from tulip_ros.errors import require
from tulip_ros.plan import Start, make_plan

PORT = 8080
LIBRARY = ("viser", "view")
"""That the page needs, and the project's extra that brings it."""


def page_beside(port: int, robot: str = "") -> tuple[Start, ...]:
    """Return the node that serves the page of a running robot.

    Args:
        port: TCP port of the page.
        robot: Namespace of the robot to begin with; "" for the one that is alone.

    Raises:
        BadInputError: if the page's library is missing.
    """
    require(*LIBRARY)
    return make_plan(["view"], None, values={"view": {"port": port, "robot": robot}})


def address(port: int) -> str:
    """Return where a browser on this machine finds the page."""
    return f"http://127.0.0.1:{port}"
