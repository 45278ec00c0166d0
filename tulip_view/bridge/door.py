"""The address that viewers connect to: looks at who asks, then passes bytes between viewer and server as they are.

The server library does not look at the page that asks, and knows the protocol under one name only. It listens behind
the door, on a loopback address that is drawn anew each time: a page that tries ports of 127.0.0.1 does not find it.
"""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
from collections.abc import Callable, Collection, Coroutine
from http import HTTPStatus
from typing import Any

from tulip_ros.errors import BadInputError
from tulip_view.bridge.handshake import END, RefusedError, admit, answered

LONGEST_HEAD = 16384  # [B] of a request; a browser's has some hundred
PATIENCE = 10.0  # [s] for the head of a request
CHUNK = 262144  # [B] passed on at once


class Door:
    """Listens, and runs in a thread of its own."""

    def __init__(
        self,
        host: str,
        port: int,
        server: tuple[str, int],
        origins: Collection[str],
        say: Callable[[str], None],
    ) -> None:
        """Open it.

        Args:
            host: Address to listen on: 127.0.0.1 for this machine alone, 0.0.0.0 for all networks.
            port: Port to listen on; 0 for any.
            server: Address and port of the server behind.
            origins: Pages that may come in, as for `admit`.
            say: Is told who was refused and why, from another thread.

        Raises:
            BadInputError: if the address or port cannot be had.
        """
        self._server, self._origins, self._say = server, origins, say
        try:
            self._socket = socket.create_server((host, port))
        except (OSError, OverflowError) as error:
            raise BadInputError(
                f"Port {port} of {host} cannot be had: {getattr(error, 'strerror', None) or error}. "
                "Is a bridge running already? End it, or choose another port with --port."
            ) from error
        self.port: int = self._socket.getsockname()[1]
        self._opened = threading.Event()
        self._thread = threading.Thread(target=asyncio.run, args=(self._serve(),), name="door", daemon=True)
        self._thread.start()
        self._opened.wait()

    def close(self) -> None:
        """Close it, and every connection through it."""
        self._loop.call_soon_threadsafe(self._closing.set)
        self._thread.join()

    async def _serve(self) -> None:
        self._loop, self._closing = asyncio.get_running_loop(), asyncio.Event()
        listener = await asyncio.start_server(self._let_in, sock=self._socket, limit=LONGEST_HEAD)
        self._opened.set()
        await self._closing.wait()
        listener.close()  # connections end with this coroutine

    async def _let_in(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve one connection; one that goes away in the middle is no error."""
        with contextlib.suppress(OSError, asyncio.IncompleteReadError, TimeoutError, asyncio.CancelledError):
            try:
                admission = admit(await _head(reader), self._origins)
            except RefusedError as refusal:
                writer.write(refusal.answer())
                await writer.drain()
                if refusal.status is not HTTPStatus.UPGRADE_REQUIRED:  # a person who just looks
                    self._say(f"connection from {writer.get_extra_info('peername')[0]} refused: {refusal}")
            else:
                server_reader, server_writer = await asyncio.open_connection(*self._server, limit=CHUNK)
                try:
                    server_writer.write(admission.request)
                    writer.write(answered(await server_reader.readuntil(END), admission.name))
                    await _either(_pass_on(reader, server_writer), _pass_on(server_reader, writer))
                finally:
                    server_writer.close()
        writer.close()


async def _head(reader: asyncio.StreamReader) -> bytes:
    try:
        return await asyncio.wait_for(reader.readuntil(END), PATIENCE)
    except asyncio.LimitOverrunError as error:
        words = f"The head of the request is too long; expected at most {LONGEST_HEAD} bytes."
        raise RefusedError(HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, words) from error


async def _pass_on(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(CHUNK):
        writer.write(data)
        await writer.drain()


async def _either(*ways: Coroutine[Any, Any, None]) -> None:
    """Go both ways until one side has left; end the other way, then."""
    tasks = [asyncio.ensure_future(way) for way in ways]
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        for task in done:
            task.result()
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
