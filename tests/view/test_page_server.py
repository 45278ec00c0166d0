"""The page's server: its port, who may connect, and what malformed messages do."""

from __future__ import annotations

import socket
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("viser", reason="viser is not installed: pip install -e '.[view]'")

import viser
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from tulip_description.robot import load_robot
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_ros.nodes import NODES
from tulip_ros.plan import make_plan
from tulip_view.live import beside
from tulip_view.live.log_feed import LogFeed
from tulip_view.live.scene import Scene
from tulip_view.live.server import REFUSED, is_own, open_server
from tulip_view.live.time_panel import TimePanel
from tulip_view.live.view_log import show_recording
from tulip_view.live.view_node import ViewParameters

WALK = Path(__file__).parent.parent / "data" / "recordings" / "walk" / "walk.mcap"
PATIENCE = 30.0  # [s]


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = int(probe.getsockname()[1])
    opened = open_server(port, lan=False)
    yield opened
    opened.stop()


def visit(server: viser.ViserServer, origin: str | None) -> ClientConnection:
    version = f"viser-v{viser.__version__}"
    return connect(f"ws://127.0.0.1:{server.get_port()}", origin=origin, subprotocols=[version], max_size=None)  # type: ignore[arg-type]


def test_a_port_that_is_taken_is_refused_with_the_remedy(server: viser.ViserServer):
    with pytest.raises(BadInputError, match=f"Port {server.get_port()} is taken.*--port"):
        open_server(server.get_port(), lan=False)


def test_the_page_is_on_loopback_alone(server: viser.ViserServer):
    assert server.get_host() == "127.0.0.1"


def test_a_page_from_elsewhere_in_the_same_browser_is_refused(server: viser.ViserServer):
    with visit(server, "http://evil.example:8080") as stranger, pytest.raises(ConnectionClosed) as closed:
        while True:
            stranger.recv(timeout=PATIENCE)
    assert closed.value.rcvd is not None and closed.value.rcvd.code == REFUSED
    with visit(server, f"http://localhost:{server.get_port()}") as own:
        assert own.recv(timeout=PATIENCE)


def test_a_malformed_message_ends_its_sender_and_nobody_else(
    server: viser.ViserServer, caplog: pytest.LogCaptureFixture
):
    with visit(server, None) as good, visit(server, None) as bad:
        assert good.recv(timeout=PATIENCE)
        bad.send(b"\xff\x00 no message")
        with pytest.raises(ConnectionClosed):
            while True:
                bad.recv(timeout=PATIENCE)
        (told,) = [record for record in caplog.records if record.name == "websockets.server"]
        assert told.getMessage().startswith("the page: connection handler failed") and not told.exc_info
        server.scene.add_frame("/still_here")
        server.flush()
        assert good.recv(timeout=PATIENCE)


@pytest.mark.parametrize(
    ("origin", "lan", "own"),
    [
        (None, False, True),
        ("http://127.0.0.1:8080", False, True),
        ("http://[::1]:8080", False, True),
        ("http://localhost:8080", False, True),
        ("http://192.168.1.7:8080", False, False),
        ("http://192.168.1.7:8080", True, True),
        (f"http://{socket.gethostname()}:8080", True, True),
        ("http://robot.evil.example:8080", True, False),
        ("null", False, False),
        ("http://[evil", True, False),  # no address at all
    ],
)
def test_only_addresses_of_this_machine_are_own(origin: str | None, lan: bool, own: bool):
    assert is_own(origin, lan) == own


def test_a_page_beside_a_robot_is_one_more_node_outside_all_namespaces():
    (start,) = beside.page_beside(8123, "striker")
    assert start.entry is NODES["view"] and start.namespace == ""
    assert start.parameters["port"] == 8123 and start.parameters["robot"] == "striker"
    assert not start.entry.playing
    assert "view" not in {start.name for start in make_plan()}  # a robot plays without


def test_a_missing_library_is_named_with_the_remedy(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(beside, "LIBRARY", ("no_such_library", "view"))
    with pytest.raises(BadInputError, match=r"no_such_library.*\.\[view\]"):
        beside.page_beside(8123)


def test_a_port_that_does_not_exist_is_refused():
    with pytest.raises(ValueError, match="port is 70000"):
        ViewParameters(port=70000)


def test_a_recording_that_is_cut_is_refused_with_the_remedy_before_anything_is_opened(tmp_path: Path):
    file = tmp_path / "cut.mcap"
    file.write_bytes(WALK.read_bytes()[:100_000])
    with pytest.raises(BadInputError, match=r"recover\.py"):
        show_recording(file, None, 1, False, lambda: None, threading.Event())


def test_damage_inside_a_recording_is_told_on_the_page_and_the_rest_can_still_be_seen(
    server: viser.ViserServer, tmp_path: Path
):
    data = bytearray(WALK.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 64] = bytes(64)
    file = tmp_path / "damaged.mcap"
    file.write_bytes(data)
    with Log(file) as log:
        scene = Scene(load_robot())
        panel = TimePanel(server, LogFeed(log, scene))
        for instant in (11.0, 2.0):
            panel._wanted = instant
            panel.update()
        assert "recover.py" in panel._note.content
        assert scene.stamp == pytest.approx(2.0, abs=0.05) and scene.estimate() is not None
