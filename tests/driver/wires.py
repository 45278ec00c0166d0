"""Both ends of a wire in one process, for tests: every packet is bytes on the way, time is the emulated body's."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from bodies import ROBOT, VirtualBody

from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.contract import Body
from tulip_driver.wire.body import WireBody
from tulip_driver.wire.server import WireServer


class Pipe:
    """The driver's end; while it waits, the body at the other end lives on by one exchange."""

    def __init__(self, body: Body, damage: Callable[[bytes], bytes] = lambda data: data) -> None:
        self.to_body: deque[bytes] = deque()
        self.to_driver: deque[bytes] = deque()
        self.server = WireServer(_Other(self), ROBOT.joint_names)
        self._body, self._damage = body, damage
        body.start()

    def send(self, data: bytes) -> None:
        self.to_body.append(data)

    def receive(self, timeout: float) -> bytes | None:
        if not self.to_driver and timeout > 0.0:
            self.live()
        return self._damage(self.to_driver.popleft()) if self.to_driver else None

    def live(self) -> Sensors:
        """Let the body take one command, and send one reading."""
        command: JointCommand | None = self.server.receive(0.0)
        reading = self._body.exchange(command)
        self.server.send(reading)
        return reading

    def close(self) -> None:
        while self.server.receive(0.0) is not None:
            pass


class _Other:
    """The body's end."""

    def __init__(self, pipe: Pipe) -> None:
        self._pipe, self._greeted = pipe, False

    def send(self, data: bytes) -> None:
        if self._greeted:
            self._pipe.to_driver.append(data)

    def reply(self, data: bytes) -> None:
        self._pipe.to_driver.append(data)

    def receive(self, timeout: float) -> bytes | None:
        return self._pipe.to_body.popleft() if self._pipe.to_body else None

    def keep(self) -> None:
        self._greeted = True

    @property
    def from_peer(self) -> bool:
        return self._greeted

    def close(self) -> None:
        pass


class VirtualWire(WireBody):
    """The driver's end of such a wire, in the body's time."""

    hardware = False
    simulated = True

    def __init__(self, body: Body | None = None) -> None:
        super().__init__(ROBOT)
        self._other = body or VirtualBody()

    def connect(self) -> Pipe:
        return Pipe(self._other)
