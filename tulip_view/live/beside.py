"""The page beside other nodes: as one more process of a launcher. Without the page's own library."""

from __future__ import annotations

import importlib.util

from tulip_ros.errors import BadInputError
from tulip_ros.plan import Start, make_plan

LIBRARY = "viser"
PORT = 8080


def check_installed() -> None:
    """Check that the page's library is there.

    Raises:
        BadInputError: if not.
    """
    if importlib.util.find_spec(LIBRARY) is None:
        raise BadInputError(
            f"The page needs the library {LIBRARY}, which is not installed. Install the project's extra `view`: "
            "pip install -e '.[view]'"
        )


def page_beside(port: int, robot: str = "") -> tuple[Start, ...]:
    """Return the node that serves the page of a running robot.

    Args:
        port: TCP port of the page.
        robot: Namespace of the robot to begin with; "" for the one that is alone.

    Raises:
        BadInputError: if the page's library is missing.
    """
    check_installed()
    return make_plan(["view"], None, values={"view": {"port": port, "robot": robot}})


def address(port: int) -> str:
    """Return where a browser on this machine finds the page."""
    return f"http://127.0.0.1:{port}"
