from __future__ import annotations

import socket
import time

import pytest

from tulip_ros.errors import BadInputError
from tulip_ros.run import ComponentNode, session
from tulip_sim.referee_link import hear_replies, open_referee
from tulip_strategy.game_controller import Reply, encode_reply

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("ros_domain")]


def test_a_reply_port_in_use_is_an_error_that_names_port_and_remedy() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        with pytest.raises(
            BadInputError, match=rf"UDP port {port}: Address already in use.*set the parameter reply_po"
        ):
            open_referee("127.0.0.1", 3838, 20, port)
        open_referee("127.0.0.1", port, 7).close()  # in version 7 it needs no port of its own


def test_replies_are_counted_and_bad_ones_named(capfd: pytest.CaptureFixture[str]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with (
        session(lambda: ComponentNode("driver"), ["test"]) as (node, spin),
        open_referee("127.0.0.1", 3838, 12, port) as referee,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as robot,
    ):
        for data in (encode_reply(Reply(25, 1, version=2)), b"RGrt\3\1\1\1"):
            robot.sendto(data, ("127.0.0.1", port))
        time.sleep(0.1)
        hear_replies(referee, node.health)
        spin(0.0)
        assert dict(node.health._events) == {"replies of robots": 1, "rejected replies": 1}
    assert "a robot's reply is not understood: reply version is 3" in capfd.readouterr().err
