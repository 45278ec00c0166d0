"""The web server of the page: on loopback unless asked otherwise, on the port that was asked for or on none."""

from __future__ import annotations

import contextlib
import io
import ipaddress
import logging
import socket
from urllib.parse import urlsplit

import viser
from viser import _messages
from viser.infra import WebsockClientConnection

from tulip_ros.errors import BadInputError

LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"
REFUSED = 1008  # of the WebSocket protocol: policy violation


def open_server(port: int, lan: bool) -> viser.ViserServer:
    """Open the page's server.

    Args:
        port: TCP port.
        lan: Let other computers open the page, too. Whoever can reach this machine then commands the robot.

    Raises:
        BadInputError: if the port is taken or cannot be had.
    """
    logging.getLogger("websockets.server").addFilter(in_one_line)
    host = EVERYWHERE if lan else LOOPBACK
    _check(host, port)
    with contextlib.redirect_stdout(io.StringIO()):  # it prints a frame with an address that may not be the page's
        server = viser.ViserServer(host=host, port=port, label="TUlip", verbose=False)
    if server.get_port() != port:  # somebody took it since
        server.stop()
        raise _taken(port)
    # The library can lend the page to the whole internet by a button in it: not this one.
    for message in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(message)

    async def refuse_strangers(connection: WebsockClientConnection) -> None:
        """End connections that a page from elsewhere opened in the user's browser: it could command the robot.

        They end before anything was sent to them, so that they never learn the names by which buttons are pressed.
        """
        opened = server._websock_server._live_connections[connection.client_id]
        request = opened.request
        if request is not None and not is_own(request.headers.get("Origin"), lan):
            await opened.close(REFUSED, "this page may be used from its own address only")

    server._websock_server.on_client_connect(refuse_strangers)
    server.gui.configure_theme(show_logo=False, show_share_button=False, control_width="medium")
    return server


def is_own(origin: str | None, lan: bool) -> bool:
    """Return whether a browser's connection comes from our page, by the Origin that it names.

    Names other than this machine's are refused even if they lead here: whoever owns a name can make it do so.

    Args:
        origin: As in "http://localhost:8080"; None for a program that is no browser.
        lan: Whether other computers may open the page.
    """
    if origin is None:
        return True
    try:
        host = urlsplit(origin).hostname or ""
    except ValueError:  # no address at all
        return False
    if host in ("localhost", socket.gethostname(), f"{socket.gethostname()}.local"):
        return True
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return False
    return lan or address.is_loopback


def in_one_line(record: logging.LogRecord) -> bool:
    """Shorten the log of a connection that failed, since the other side sent what makes no sense, to one line."""
    if record.exc_info:
        record.msg, record.args = f"the page: {record.getMessage()} ({record.exc_info[1]})", ()
        record.exc_info = record.exc_text = None
    return True


def _check(host: str, port: int) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except PermissionError:
            raise BadInputError(f"Port {port} may not be used by this user; expected 1024 or more (--port).") from None
        except OSError:
            raise _taken(port) from None


def _taken(port: int) -> BadInputError:
    return BadInputError(
        f"Port {port} is taken: another view runs, or another program. End it, or choose another port with --port."
    )
