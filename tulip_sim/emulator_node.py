"""A robot's body behind the wire, in its own process with its own clock: joints, sensors and time go by bytes.

What a real robot has elsewhere stays on topics: pictures (a camera's own node), referee, truth for whoever judges.
The driver is `tulip_driver.wire.body:WireBody`, as for a real body that speaks docs/wire.md.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import NoReturn

from tulip_description.robot import load_robot
from tulip_driver.contract import BodyError
from tulip_driver.parts import by_parts
from tulip_driver.wire.links import PORT, SerialLine, UdpServer
from tulip_driver.wire.server import WireServer
from tulip_ros.errors import BadInputError
from tulip_ros.finding import Finding, Level
from tulip_ros.run import run
from tulip_sim.driver_node import DriverNode, DriverNodeParameters
from tulip_sim.harness import Harness
from tulip_sim.simulator_node import Joints, SimulatorNode, Spin

POLL = 0.001  # [s] between looks at the topics while the wire is listened to


@dataclass(frozen=True)
class EmulatorParameters(DriverNodeParameters):
    """How the body is simulated, and where its wire ends."""

    mode: str = "free"  # follows its own clock, as a body does; "sync" waits for each answer on a slow computer
    wait_for: tuple[str, ...] = ()  # it lives whether or not somebody is there
    address: str = "127.0.0.1"  # where it listens
    port: int = PORT
    device: str = ""  # serial line in place of UDP
    baud: int = 2_000_000  # bits a second of that line
    harness: bool = False  # whether it hangs from its trunk, feet off the ground


class WireJoints(Joints):
    """Sensors and joint commands on the wire."""

    def __init__(self, node: EmulatorNode) -> None:
        """Open the wire.

        Raises:
            BadInputError: if that is not possible.
        """
        p = node.settings
        try:
            link = SerialLine(p.device, p.baud) if p.device else UdpServer(p.address, p.port)
        except BodyError as error:
            raise BadInputError(str(error)) from error
        self._node = node
        self._server = WireServer(link, load_robot().joint_names)
        self._told: dict[str, int] = {}
        node.health.check(self._health)
        self.begin_anew()

    def begin_anew(self) -> None:
        """Wait for the first command."""
        self._asked: int | None = None
        self._answer = -1  # stamp of the newest sensors that were answered
        self._server.begin_anew()

    def measure(self) -> None:
        """Read the sensors."""
        self._newest = self._node.world.sensors()

    def send(self) -> None:
        """Send what was measured."""
        self._server.send(self._newest)

    @property
    def answered(self) -> bool:
        """Whether the answer to the sensors of the tick before is in."""
        return self._asked is None or self._answer >= self._asked

    def obey(self) -> None:
        """Ask for the next answer: commands act when they arrive."""
        self._asked = self._newest.stamp

    def listen(self, timeout: float) -> bool:
        """Obey the next command, if one comes within so many seconds [s]; return whether one came."""
        command = self._server.receive(timeout)
        if command is None:
            return False
        for part in by_parts(command):
            reason = self._node.world.apply(part)
            if reason:
                self._node.health.count("refused joint commands", f"joint command refused: {reason}")
        self._answer = command.stamp
        self._node.heard_legs()
        return True

    def close(self) -> None:
        """End the wire."""
        self._server.close()

    def _health(self) -> Finding | None:
        """Tell what came over the wire that was not taken in the last second."""
        fresh = {words: count - self._told.get(words, 0) for words, count in self._server.refused.items()}
        self._told = dict(self._server.refused)
        for words, count in fresh.items():
            self._node.health.count(f"wire: {words}", times=count)
        came = [words for words, count in fresh.items() if count]
        if not came:
            return None
        return Finding(Level.WARNING, f"the wire brought {' and '.join(came)}: look at who sends to it")


class EmulatorNode(DriverNode):
    """Owns the world of one robot whose joints are at the end of a wire."""

    def __init__(self) -> None:
        """Make the world, open the wire."""
        self._harness: Harness | None = None
        super().__init__("emulator", EmulatorParameters(), self._open, tells_time=False)

    @property
    def settings(self) -> EmulatorParameters:
        """The node's parameters."""
        assert isinstance(self._settings, EmulatorParameters)
        return self._settings

    def advance(self, spin: Spin) -> None:
        """Let one control tick pass; wherever it waits, it listens to the wire, too."""
        if self.settings.harness:
            if self._harness is None or self._harness.world is not self.world:
                self._harness = Harness(self.world)
            self._harness.pull()
        super().advance(lambda timeout: self._wait(spin, timeout))

    def destroy_node(self) -> None:
        """End the wire, and end."""
        self._wire.close()
        super().destroy_node()

    def _open(self, node: SimulatorNode, robot: int, namespace: str) -> Joints:
        self._wire = WireJoints(self)
        return self._wire

    def _wait(self, spin: Spin, timeout: float) -> None:
        """Wait until a command comes over the wire, or so many seconds have passed; handle messages meanwhile."""
        end = time.monotonic() + timeout
        while True:
            spin(0.0)
            left = end - time.monotonic()
            if self._wire.listen(min(left, POLL)) or left <= 0.0:
                return


def main() -> NoReturn:
    """Run the body until SIGINT or SIGTERM."""
    run(EmulatorNode, EmulatorNode.advance)


if __name__ == "__main__":
    main()
