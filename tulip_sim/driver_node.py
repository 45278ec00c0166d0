"""The simulator behind the driver's contract: joint commands in; sensors, pictures, clock and truth out.

In `sync` mode a control tick passes only when the command that answers the sensors of the tick before is
in, so a slow or loaded machine runs slower, not worse. Physics and control work at the same time: while
the world advances by one tick, motion control computes the answer that acts in the next.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_description.urdf import build_urdf
from tulip_motion.messages import joint_command_from_message, sensors_to_messages
from tulip_msgs.msg import FootForces
from tulip_msgs.msg import JointCommand as JointCommandMessage
from tulip_msgs.srv import PlaceBall, Push, Reset
from tulip_ros import topics
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import stamp_of, to_message
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_sim.messages import jpeg_to_message, lens_to_message, truth_to_message
from tulip_sim.parameters import WorldParameters
from tulip_sim.referee import Referee, RefereeParameters
from tulip_sim.referee_udp import RefereeSocket
from tulip_sim.scenario import SCENARIOS, make_scenario
from tulip_sim.timing import CAMERA_TICKS, SLOW_TICKS, TICK
from tulip_sim.world import World
from tulip_strategy.game_controller import REFEREE_PORT
from tulip_vision.lens import head_camera_lens
from tulip_vision.messages import picture_to_message

LAG = 0.05  # [s] behind the wall clock after which the lost time is given up
REPEAT = 0.1  # [s] of wall-clock time between repetitions of sensors that nobody answered
PUSH_TIME = 100  # [ms] over which a push's impulse is spread
MODES = ("sync", "free")


@dataclass(frozen=True)
class DriverNodeParameters:
    """How the simulator runs, and what it simulates."""

    mode: str = "sync"  # "sync" waits for the answer to each tick's sensors; "free" follows the wall clock
    speed: float = 1.0  # times real time at most; 0 for as fast as it can
    scenario: str = "trial"
    seed: int = 0
    camera: bool = True
    referee: bool = True
    referee_address: str = "127.0.0.1"
    referee_port: int = REFEREE_PORT
    answer_bound: float = 0.3  # [s] of wall-clock time to wait for an answer in sync mode
    start_bound: float = 30.0  # [s] of wall-clock time to wait for the other nodes at the start
    wait_for: tuple[str, ...] = ("motion",)  # nodes that must be in the graph before time begins
    world: WorldParameters = field(default_factory=WorldParameters)
    pictures: CameraParameters = field(default_factory=CameraParameters)
    rules: RefereeParameters = field(default_factory=RefereeParameters)

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not usable.
        """
        if self.mode not in MODES:
            raise ValueError(f"mode is {self.mode!r}; expected one of {', '.join(MODES)}")
        if self.scenario not in SCENARIOS:
            raise ValueError(f"scenario is {self.scenario!r}; expected one of {', '.join(SCENARIOS)}")
        for name in ("speed", "answer_bound", "start_bound"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}; expected a finite number >= 0")
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}; expected >= 0")


class DriverNode(ComponentNode):
    """Owns the world and its time."""

    def __init__(self) -> None:
        """Make the world and connect it."""
        super().__init__("driver")
        p = self._settings = self.load(DriverNodeParameters())
        self._field, self._robot, self._lens = load_field(), load_robot(), head_camera_lens()
        self._cells = np.array([foot.cells for foot in self._robot.feet])
        self._camera = CameraRenderer(p.pictures, self._field, self._robot, self._lens)
        self._referee = Referee(p.rules, self._field)
        self._referee_socket = RefereeSocket(p.referee_address, p.referee_port) if p.referee else None
        self._joints = self.sender(topics.JOINT_STATES)
        self._imu = self.sender(topics.IMU)
        self._forces = self.sender(topics.FOOT_FORCES)
        self._pictures = self.sender(topics.CAMERA_IMAGE)
        self._compressed = self.sender(topics.CAMERA_COMPRESSED)
        self._clock_sender = self.sender(topics.CLOCK)
        self._truth = self.sender(topics.GROUND_TRUTH)
        self._lens_sender = self.sender(topics.CAMERA_INFO)
        self._description = self.sender(topics.ROBOT_DESCRIPTION)
        self._description.publish(String(data=build_urdf(self._robot)))
        self.listen(topics.LEG_COMMAND, self._on_legs)
        self.listen(topics.HEAD_JOINT_COMMAND, self._on_head)
        for service, answer in (
            (topics.RESET, self._on_reset),
            (topics.PLACE_BALL, self._on_place_ball),
            (topics.PUSH, self._on_push),
        ):
            self.create_service(service.type, service.name, answer)
        self._wish: tuple[str, int] | None = None  # scenario and seed to begin anew with
        self._begin(p.scenario, p.seed)

    def _begin(self, scenario: str, seed: int) -> None:
        p = self._settings
        self._scenario_name = scenario
        rng = np.random.default_rng(seed)
        self._world = World(make_scenario(scenario, rng, self._field), p.world, seed, self._field, self._robot)
        self._camera_rng = np.random.default_rng([seed, 1])
        self._referee.restart()
        self._tick = 0
        self._asked: int | None = None  # stamp of the sensors whose answer is due
        self._answer: JointCommandMessage | None = None
        self._waits = p.mode == "sync"
        self._started = False
        self._paced_from = (time.monotonic(), 0)
        self._lens_sender.publish(lens_to_message(self._lens, 0))

    def _await_nodes(self, spin: Callable[[float], None]) -> None:
        """Wait until the nodes of `wait_for` are in the graph, so that time begins with a whole robot."""
        p, own = self._settings, self.get_namespace()
        begin = time.monotonic()
        missing = set(p.wait_for)
        while missing and time.monotonic() - begin < p.start_bound:
            spin(REPEAT)
            missing -= {name for name, namespace in self.get_node_names_and_namespaces() if namespace == own}
        if missing:
            self.health.count("started without nodes", f"time begins without {', '.join(sorted(missing))}")
        self._paced_from = (time.monotonic(), self._world.stamp)

    def advance(self, spin: Callable[[float], None]) -> None:
        """Let one control tick pass.

        Args:
            spin: Waits up to so many seconds [s] for messages and handles them.
        """
        if self._wish is not None:
            wish, self._wish = self._wish, None
            self._world.close()
            self._begin(*wish)
        sensors = self._world.sensors()
        messages = sensors_to_messages(sensors, self._cells)
        if self._tick == 0:
            self._await_nodes(spin)
        self._send(messages)
        spin(0.0)
        if self._asked is not None and self._waits:
            self._await_answer(messages, spin)
        if self._answer is not None:
            self._apply(self._answer)
            self._answer = None
        self._asked = sensors.stamp
        self._world.advance(TICK)
        truth = self._world.truth()
        packet = self._referee.update(truth)
        if packet is not None and self._referee_socket is not None:
            self._referee_socket.send(packet)
            self._referee_socket.replies()  # emptied, so that they do not fill the system's buffer
        if self._tick % SLOW_TICKS == 0:
            self._clock_sender.publish(Clock(clock=to_message(truth.stamp)))
            self._truth.publish(truth_to_message(truth, self._referee.verdict()))
        if self._settings.camera and self._tick % CAMERA_TICKS == 0:
            picture = self._camera.render(truth, self._camera_rng)
            self._pictures.publish(picture_to_message(picture, truth.stamp))
            if self._compressed.get_subscription_count() > 0:
                self._compressed.publish(jpeg_to_message(picture, truth.stamp))
        self._tick += 1
        self._pace(spin)

    def _send(self, messages: tuple[JointState, Imu, FootForces]) -> None:
        joints, imu, forces = messages
        self._joints.publish(joints)
        self._imu.publish(imu)
        self._forces.publish(forces)

    def _await_answer(self, newest: tuple[JointState, Imu, FootForces], spin: Callable[[float], None]) -> None:
        """Wait for the answer to the sensors of the tick before; the newest ones are already out."""
        p = self._settings
        begin = time.monotonic()
        bound = p.answer_bound if self._started else p.start_bound
        repeat = begin + REPEAT
        while not self._answered() and self._wish is None:
            now = time.monotonic()
            if now - begin > bound:
                # From here on time follows the wall clock, as it would on the robot, until answers come again.
                self.health.count("ticks without an answer", "no leg command comes: the simulation goes on without")
                self._waits = False
                return
            if now > repeat:
                # Motion control may have been restarted: what it missed would never be answered.
                self._send(newest)
                repeat = now + REPEAT
            spin(min(REPEAT, bound))
        self._started = True

    def _answered(self) -> bool:
        return self._answer is not None and self._asked is not None and stamp_of(self._answer) >= self._asked

    def _is_from_before(self, message: JointCommandMessage) -> bool:
        """Tell whether a command answers sensors that are still to come: it was on its way when time began anew."""
        return stamp_of(message) > self._world.stamp

    def _on_legs(self, message: JointCommandMessage) -> None:
        if self._is_from_before(message):
            return
        self._answer = message
        if not self._waits and self._settings.mode == "sync":
            self._waits = True
            self._paced_from = (time.monotonic(), self._world.stamp)

    def _on_head(self, message: JointCommandMessage) -> None:
        if not self._is_from_before(message):
            self._apply(message)

    def _apply(self, message: JointCommandMessage) -> None:
        reason = self._world.apply(joint_command_from_message(message))
        if reason:
            self.health.count("refused joint commands", f"joint command refused: {reason}")

    def _pace(self, spin: Callable[[float], None]) -> None:
        """Keep to the wall clock: never faster than `speed`, and without catching up when it was slower."""
        speed = self._settings.speed if self._waits else 1.0
        if speed == 0.0:
            return
        wall, stamp = self._paced_from
        due = wall + (self._world.stamp - stamp) * 1e-9 / speed
        ahead = due - time.monotonic()
        if ahead < -LAG:
            self._paced_from = (time.monotonic(), self._world.stamp)
        while ahead > 0.0:
            spin(ahead)
            ahead = due - time.monotonic()

    def _on_reset(self, request: Reset.Request, response: Reset.Response) -> Reset.Response:
        name = request.scenario or self._scenario_name
        if name not in SCENARIOS:
            response.message = f"scenario is {name!r}; expected one of {', '.join(SCENARIOS)}"
        elif request.seed < 0:
            response.message = f"seed is {request.seed}; expected >= 0"
        else:
            self._wish = (name, request.seed)  # for the next tick: the present one is under way
            response.success = True
        return response

    def _on_place_ball(self, request: PlaceBall.Request, response: PlaceBall.Response) -> PlaceBall.Response:
        try:
            self._world.place_ball(*request.position.tolist(), *request.velocity.tolist())
            response.success = True
        except ValueError as error:
            response.message = str(error)
        return response

    def _on_push(self, request: Push.Request, response: Push.Response) -> Push.Response:
        try:
            self._world.push(request.impulse / (PUSH_TIME * 1e-3), PUSH_TIME)
            response.success = True
        except ValueError as error:
            response.message = str(error)
        return response


def main() -> NoReturn:
    """Run the simulator until SIGINT or SIGTERM."""
    run(DriverNode, DriverNode.advance)


if __name__ == "__main__":
    main()
