"""Node "game_input": referee packets from UDP in, game_state out, replies back to the referee."""

from __future__ import annotations

import socket
from dataclasses import dataclass

from rclpy.serialization import deserialize_message

from tulip_msgs.msg import MotionState, WorldState
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.finding import Finding, Level
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import stamp_of
from tulip_strategy.complaints import Complaints
from tulip_strategy.game_controller import REFEREE_PORT, REPLY_MAGIC, RobotStatus
from tulip_strategy.game_input import GameInput, GameInputParameters
from tulip_strategy.messages import game_state_to_message, robot_status_from_messages

POLL = 0.02  # [s] of wall-clock time between two looks at the socket: short against 0.5 s between packets
MOST_PACKETS = 50  # a look; a flood must not stop the node
DATAGRAM = 2048  # [B] more than any version's packet, so that a wrong size shows
REPLY_PERIOD = 1.0  # [s] of wall-clock time, which the referee program goes by
REFUSED_LATELY = 2_000_000_000  # [ns] four packets of a referee that sends at 2 Hz
STATUS_AGE = 2_000_000_000  # [ns] an older status is not told: nobody knows whether it still holds


@dataclass(frozen=True)
class GameInputNodeParameters(GameInputParameters):
    """Parameters of game input and of its socket."""

    address: str = "127.0.0.1"  # interface to listen on; "0.0.0.0" on a robot, whose referee is another machine
    port: int = REFEREE_PORT  # UDP
    reply_port: int = 0  # UDP, at the referee; 0 for the one that the packet's version has

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is out of its range.
        """
        super().__post_init__()
        for name, least in (("port", 1), ("reply_port", 0)):
            if not least <= getattr(self, name) < 65536:
                raise ValueError(f"{name} is {getattr(self, name)}; expected {least} to 65535")


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
        # Not deserialized before a reply needs them: that is once a second, and the legs' state comes at 250 Hz.
        topics.MOTION_STATE.subscribe_from(self, self._on_motion, raw=True, depth=1)
        topics.WORLD_STATE.subscribe_from(self, self._on_world, raw=True, depth=1)
        self._motion_watch = self.health.expect(topics.MOTION_STATE)
        self._world_watch = self.health.expect(topics.WORLD_STATE)
        self.health.check(self._referee_health)
        self.every(POLL, self._poll)
        self.every(REPLY_PERIOD, self._reply)

    def begin_anew(self) -> None:
        """Make the core, which waits for the first packet."""
        self._input = GameInput(self._settings)
        self._complaints = Complaints()
        self._referee: tuple[str, int] | None = None  # who sent the last packet that was taken
        self._motion: bytes | None = None
        self._world: bytes | None = None
        self._stale = False
        self._refused: tuple[int, str] | None = None  # when the last packet was refused [ns], and why

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

    def _on_motion(self, data: bytes) -> None:
        self._motion_watch.count += 1
        self._motion = data

    def _on_world(self, data: bytes) -> None:
        self._world_watch.count += 1
        self._world = data

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
            self._refused = (stamp, rejected.reason)
            is_new = self._complaints.is_new(rejected.reason, stamp)
            self.health.count(f"rejected packets ({rejected.fault.value})", rejected.reason if is_new else "")
            return
        self.health.count("packets")
        is_first, self._referee = self._referee is None, sender
        self._publish(stamp)
        if is_first:
            self._reply()

    def _reply(self) -> None:
        """Answer the referee, unless it is silent or the reply needs to tell what is not known."""
        state = self._input.state(self._now())
        if self._referee is None or state is None or state.stale:
            return
        answer = self._input.answer(self._status() if self._input.needs_status else None)
        if answer is None:
            self.health.count("replies put off")
            return
        host, sent_from = self._referee
        p = self._settings
        # In versions 7 and 8 the referee listens on the same port as robots do.
        port = p.reply_port or (p.port if answer.port == REFEREE_PORT else answer.port)
        # A referee on this machine cannot hold our own port: it is answered where its packet came from.
        if port == p.port and _is_this_machine(host):
            port = sent_from
        try:
            self._socket.sendto(answer.data, (host, port))
            self.health.count("replies")
        except OSError as error:
            self.health.count("lost replies", f"cannot reply to the referee: {error.strerror or error}")

    def _status(self) -> RobotStatus | None:
        """Return the robot's status, or None while motion control or the world model do not tell it."""
        if self._motion is None or self._world is None:
            return None
        motion, world = deserialize_message(self._motion, MotionState), deserialize_message(self._world, WorldState)
        if max(abs(self._now() - stamp_of(message)) for message in (motion, world)) > STATUS_AGE:
            return None
        return robot_status_from_messages(motion, world)

    def _watch_age(self) -> None:
        state = self._input.state(self._now())
        if state is not None and state.stale != self._stale:
            self._publish(self._now())
            if state.stale:
                self.health.count("silences", f"no packet from the referee for {self._settings.stale_after} s")

    def _referee_health(self) -> Finding | None:
        """Tell how the referee is heard: what it sends that cannot be used, or that it is silent."""
        now = self._now()
        state = self._input.state(now)
        if self._refused is not None and abs(now - self._refused[0]) < REFUSED_LATELY:
            reason = f"packets refused: {self._refused[1]}"
            if state is None or state.stale:
                return Finding(Level.ERROR, f"the referee is not understood, {reason}")
            return Finding(Level.WARNING, reason)
        if state is None:
            return Finding(Level.OK, f"no packet from a referee yet on UDP {self._settings.port}")
        if state.stale:
            silence = (now - state.stamp) / 1e9
            return Finding(
                Level.WARNING,
                f"no packet from the referee for {silence:.0f} s: look after its program and the network",
            )
        return None

    def _publish(self, stamp: int) -> None:
        state = self._input.state(stamp)
        if state is not None:
            self._stale = state.stale
            self._state.publish(game_state_to_message(state))

    def _now(self) -> int:
        """Return the time [ns]: packets carry no stamp of their own."""
        return int(self.get_clock().now().nanoseconds)


def _is_this_machine(host: str) -> bool:
    """Tell whether an address is one of this machine: only such a one can be bound."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((host, 0))
        except OSError:
            return False
    return True


def main() -> None:
    """Run the node."""
    run(GameInputNode)


if __name__ == "__main__":
    main()
