"""The opening of a WebSocket connection: who may come in, and under which name the protocol is spoken.

The protocol has had two names; its messages are the same. The server library knows the current one alone.
"""

from __future__ import annotations

import http.client
import io
import ipaddress
from collections.abc import Collection
from http import HTTPStatus
from typing import NamedTuple
from urllib.parse import urlsplit

CURRENT, OLDER = "foxglove.sdk.v1", "foxglove.websocket.v1"
PROTOCOL, ORIGIN, UPGRADE = "Sec-WebSocket-Protocol", "Origin", "Upgrade"
END = b"\r\n\r\n"
"""Ends the head of a request or of an answer."""

VIEWERS = ("https://app.foxglove.dev", "https://studio.foxglove.dev", "file://")
"""Pages that are not of this machine and may come in: Foxglove in the browser, and as a program of its own."""


class RefusedError(Exception):
    """A connection that is refused."""

    def __init__(self, status: HTTPStatus, words: str) -> None:
        """Keep the answer.

        Args:
            status: Of the answer.
            words: What is wrong, what was expected, and what to do.
        """
        super().__init__(words)
        self.status = status

    def answer(self) -> bytes:
        """Return the answer to whoever asked."""
        body = f"{self}\n".encode()
        lines = (
            f"HTTP/1.1 {self.status.value} {self.status.phrase}",
            "Content-Type: text/plain; charset=utf-8",
            f"Content-Length: {len(body)}",
            "Connection: close",
        )
        return "\r\n".join(lines).encode() + END + body


class Admission(NamedTuple):
    """A connection that may come in.

    Attributes:
        request: Head of the request to pass on to the server.
        name: Name under which this viewer knows the protocol.
    """

    request: bytes
    name: str


def admit(head: bytes, origins: Collection[str] = ()) -> Admission:
    """Check the head of a request.

    Browsers tell in `Origin` which page asks, and let any page ask for any address: so pages of other hosts are
    refused. A program that is no browser may leave it out, or say what it likes: against those only the address helps
    on which the bridge listens.

    Args:
        head: From the first line to the empty one.
        origins: Pages that may come in besides those of this machine and `VIEWERS`, as in "http://192.168.0.7:8080".

    Raises:
        RefusedError: if it may not come in.
    """
    first, lines = _split(head)
    if not first.startswith("GET ") or lines.get(UPGRADE, "").lower() != "websocket":
        raise RefusedError(
            HTTPStatus.UPGRADE_REQUIRED,
            "This is the bridge of the TUlip soccer robot, for Foxglove and viewers like it. "
            "There: Open connection, Foxglove WebSocket, this address with ws:// in place of http://.",
        )
    page = lines.get(ORIGIN)
    if page is not None and not _may_ask(page, origins):
        raise RefusedError(
            HTTPStatus.FORBIDDEN,
            f"The page of {_shown(page)} may not control this robot; pages of this machine and Foxglove's may. "
            f"To let it in, start the bridge with --origin {_shown(page)}",
        )
    named = [name.strip() for value in lines.get_all(PROTOCOL, []) for name in value.split(",")]
    name = next((known for known in (CURRENT, OLDER) if known in named), None)
    if name is None:
        raise RefusedError(
            HTTPStatus.BAD_REQUEST,
            f"Sub-protocol is {_shown(', '.join(named)) or 'not named'};"
            f" expected {CURRENT}, or {OLDER} of older viewers.",
        )
    return Admission(_renamed(first, lines, CURRENT), name)


def answered(head: bytes, name: str) -> bytes:
    """Return the head of the server's answer with the protocol's name as the viewer knows it."""
    first, lines = _split(head)
    return _renamed(first, lines, name) if PROTOCOL in lines else head


def is_loopback(host: str | None) -> bool:
    """Return whether a host is this machine as it calls itself."""
    if host is None:
        return False
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _may_ask(page: str, origins: Collection[str]) -> bool:
    if page in VIEWERS or page in origins:
        return True
    try:
        return is_loopback(urlsplit(page).hostname)
    except ValueError:  # no address at all
        return False


def _shown(words: str) -> str:
    """Return a stranger's words so that they cannot pass for lines of a log, or steer a terminal."""
    return words[:200] if words.isprintable() else repr(words[:200])


def _split(head: bytes) -> tuple[str, http.client.HTTPMessage]:
    first, _, rest = head.partition(b"\r\n")
    try:
        return first.decode("latin-1"), http.client.parse_headers(io.BytesIO(rest))
    except http.client.HTTPException as error:
        raise RefusedError(HTTPStatus.BAD_REQUEST, f"That is no HTTP request: {error}.") from error


def _renamed(first: str, lines: http.client.HTTPMessage, name: str) -> bytes:
    kept = [f"{key}: {value}" for key, value in lines.items() if key.lower() != PROTOCOL.lower()]
    return "\r\n".join([first, *kept, f"{PROTOCOL}: {name}"]).encode("latin-1") + END
