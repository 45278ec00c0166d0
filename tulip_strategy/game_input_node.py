"""Node "game_input": referee packets from UDP in, game_state out, replies back to the referee."""

from __future__ import annotations

import socket
from dataclasses import dataclass

from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.run import ComponentNode, run
from tulip_strategy.game_controller import REFEREE_PORT, REPLY_MAGIC
from tulip_strategy.game_input import GameInput, GameInputParameters
from tulip_strategy.messages import game_state_to_message

POLL = 0.02  # [s] of wall-clock time between two looks at the socket: short against 0.5 s between packets
MOST_PACKETS = 50  # a look; a flood must not stop the node
COMPLAIN_AGAIN = 4_000_000_000  # [ns] packets come twice a second; diagnostics show a warning for 5 s
DATAGRAM = 2048  # [B] more than any version's packet, so that a wrong size shows


@dataclass(frozen=True)
class GameInputNodeParameters(GameInputParameters):
    """Parameters of game input and of its socket."""

    address: str = "127.0.0.1"  # interface to listen on; "0.0.0.0" on a robot, whose referee is another machine
    port: int = REFEREE_PORT  # UDP
    reply_port: int = REFEREE_PORT  # UDP, at the referee; 3838 in 2013

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is out of its range.
        """
        super().__post_init__()
        for name in ("port", "reply_port"):
            if not 0 < getattr(self, name) < 65536:
                raise ValueError(f"{name} is {getattr(self, name)}; expected 1 to 65535")


class GameInputNode(ComponentNode):
    """Listens to the referee."""

    def __init__(self) -> None:
        """Make the core and open the socket.

        Raises:
            BadInputError: if the port cannot be opened.
        """
        super().__init__("game_input")
        self._settings = self.load(GameInputNodeParameters())
        self.begin_anew()
        self.follow_clock()
        self._socket = self._open()
        self._state = self.sender(topics.GAME_STATE)
        self.every(POLL, self._poll)

    def begin_anew(self) -> None:
        """Make the core, which waits for the first packet."""
        self._input = GameInput(self._settings)
        self._complaints: dict[str, int] = {}  # reason: when it was given [ns]
        self._stale = False

    def destroy_node(self) -> None:
        """Close the socket and end the node."""
        self._socket.close()
        super().destroy_node()

    def _open(self) -> socket.socket:
        p = self._settings
        opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        opened.setblocking(False)
        try:
            opened.bind((p.address, p.port))
        except OSError as error:
            opened.close()
            raise BadInputError(
                f"Cannot listen to the referee on UDP {p.address}:{p.port}: {error.strerror or error}. "
                "End the program that uses the port (`ss -ulpn` lists them), or set the parameters address and port."
            ) from error
        return opened

    def _poll(self) -> None:
        if self._now() == 0:
            return  # time has not begun, or this node was restarted and has not heard of it: packets wait
        for _ in range(MOST_PACKETS):
            try:
                data, sender = self._socket.recvfrom(DATAGRAM)
            except BlockingIOError:
                break
            except ConnectionRefusedError:
                continue  # the system's notice that nobody took a reply
            self._take(data, sender)
        self._watch_age()

    def _take(self, data: bytes, sender: tuple[str, int]) -> None:
        if data[:4] == REPLY_MAGIC:
            return  # another robot's reply to a referee on this machine
        stamp = self._now()
        rejected = self._input.receive(data, stamp)
        if rejected is not None:
            self._complain(rejected.reason, stamp)
            return
        self.health.count("packets")
        self._publish(stamp)
        self._reply(sender)

    def _complain(self, reason: str, stamp: int) -> None:
        """Count a packet that was rejected; say why, but not with every packet again."""
        self._complaints = {old: at for old, at in self._complaints.items() if 0 <= stamp - at < COMPLAIN_AGAIN}
        self.health.count("rejected packets", "" if reason in self._complaints else reason)
        self._complaints.setdefault(reason, stamp)

    def _reply(self, sender: tuple[str, int]) -> None:
        p = self._settings
        # A referee on this machine cannot hold our own port: it is answered where its packet came from.
        port = sender[1] if (sender[0], p.reply_port) == self._socket.getsockname() else p.reply_port
        try:
            self._socket.sendto(self._input.reply(), (sender[0], port))
        except OSError as error:
            self.health.count("lost replies", f"cannot reply to the referee: {error.strerror or error}")

    def _watch_age(self) -> None:
        state = self._input.state(self._now())
        if state is not None and state.stale != self._stale:
            self._publish(self._now())
            if state.stale:
                self.health.count("silences", f"no packet from the referee for {self._settings.stale_after} s")

    def _publish(self, stamp: int) -> None:
        state = self._input.state(stamp)
        if state is not None:
            self._stale = state.stale
            self._state.publish(game_state_to_message(state))

    def _now(self) -> int:
        """Return the time [ns]: packets carry no stamp of their own."""
        return int(self.get_clock().now().nanoseconds)


def main() -> None:
    """Run the node."""
    run(GameInputNode)


if __name__ == "__main__":
    main()
