"""What drivers in the simulator share: the contract with each robot's nodes, and time that waits for them.

In `sync` mode a control tick passes only when the commands that answer the sensors of the tick before are
in, so a slow or loaded machine runs slower, not worse. Physics and control work at the same time: while
the world advances by one tick, motion control computes the answer that acts in the next.
"""

from __future__ import annotations

import math
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String

from tulip_description.emergency_stop import StopWord
from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_description.urdf import build_urdf
from tulip_driver.findings import silent_joints
from tulip_motion.messages import joint_command_from_message, sensors_to_messages
from tulip_msgs.msg import FootForces
from tulip_msgs.msg import JointCommand as JointCommandMessage
from tulip_ros import topics
from tulip_ros.emergency_stop import StopLink
from tulip_ros.finding import Finding, Level
from tulip_ros.run import ComponentNode
from tulip_ros.time import stamp_of, to_message
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_sim.judging import Verdict
from tulip_sim.messages import jpeg_to_message, lens_to_message, truth_to_message
from tulip_sim.parameters import WorldParameters
from tulip_sim.timing import CAMERA_TICKS, SLOW_TICKS, TICK
from tulip_sim.truth import Truth
from tulip_sim.world import World
from tulip_strategy.game_controller import REFEREE_PORT
from tulip_vision.lens import head_camera_lens
from tulip_vision.messages import picture_to_message

LAG = 0.05  # [s] behind the wall clock after which the lost time is given up
REPEAT = 0.1  # [s] of wall-clock time between repetitions of sensors that nobody answered
MODES = ("sync", "free")

Spin = Callable[[float], None]
"""Waits up to so many seconds [s] for messages and handles them."""


@dataclass(frozen=True)
class SimulatorParameters:
    """How a simulator runs."""

    mode: str = "sync"  # "sync" waits for the answer to each tick's sensors; "free" follows the wall clock
    speed: float = 1.0  # times real time at most; 0 for as fast as it can (with "sync" alone)
    seed: int = 0
    camera: bool = True
    referee: bool = True
    referee_address: str = "127.0.0.1"
    referee_port: int = REFEREE_PORT
    reply_port: int = 0  # where the referee hears robots; 0 for the port that its packets' version has
    answer_bound: float = 0.3  # [s] of wall-clock time to wait for an answer in sync mode
    start_bound: float = 30.0  # [s] of wall-clock time to wait for the other nodes at the start
    wait_for: tuple[str, ...] = ("motion",)  # nodes that must be in the graph before time begins
    world: WorldParameters = field(default_factory=WorldParameters)
    pictures: CameraParameters = field(default_factory=CameraParameters)

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not usable.
        """
        if self.mode not in MODES:
            raise ValueError(f"mode is {self.mode!r}; expected one of {', '.join(MODES)}")
        if not 0 <= self.reply_port < 65536:
            raise ValueError(f"reply_port is {self.reply_port}; expected 0 to 65535")
        for name in ("speed", "answer_bound", "start_bound"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} is {getattr(self, name)}; expected a finite number >= 0")
        if self.mode == "free" and self.speed == 0.0:
            raise ValueError("speed is 0 in mode 'free'; expected > 0, since nothing else holds the time")
        if self.seed < 0:
            raise ValueError(f"seed is {self.seed}; expected >= 0")


class Joints(ABC):
    """The way of one robot's sensors to who commands it, and of the commands back."""

    @abstractmethod
    def begin_anew(self) -> None:
        """Wait for the first command."""

    @abstractmethod
    def measure(self) -> None:
        """Read the sensors; their answer is due in the tick after this one."""

    @abstractmethod
    def send(self) -> None:
        """Send what was measured, for the first time or again."""

    @property
    @abstractmethod
    def answered(self) -> bool:
        """Whether the answer to the sensors of the tick before is in, if there were any."""

    @abstractmethod
    def obey(self) -> None:
        """Give the answer to the joints, and ask for the next."""


class TopicJoints(Joints):
    """Sensors and joint commands on topics, as a driver has them."""

    def __init__(self, node: SimulatorNode, robot: int, namespace: str) -> None:
        """Connect.

        Args:
            node: Owns the world.
            robot: Number in the world.
            namespace: Of the robot's topics, below the node's own; "" for none.
        """
        self._node, self._robot = node, robot
        body = load_robot()
        self._cells = np.array([foot.cells for foot in body.feet])
        outputs = (topics.JOINT_STATES, topics.IMU, topics.FOOT_FORCES, topics.ROBOT_DESCRIPTION)
        senders = [node.sender(topic.within(namespace)) for topic in outputs]
        self._joints, self._imu, self._forces, self._description = senders
        self._description.publish(String(data=build_urdf(body)))
        self._late = 0  # answers that were not in when they were due, in the last second
        self._name = f"{namespace}: " if namespace else ""
        node.health.check(self._command_health)
        self._emergency_stop = StopLink(
            node, "driver", self._on_emergency_stop, topics.EMERGENCY_STOP.within(namespace)
        )
        node.health.check(self._emergency_stop_health)
        node.listen(topics.LEG_COMMAND.within(namespace), self._on_legs)
        node.listen(topics.HEAD_JOINT_COMMAND.within(namespace), self._on_head)

    def begin_anew(self) -> None:
        """Wait for the first command."""
        self._asked: int | None = None  # stamp of the sensors whose answer is due
        self._answer: JointCommandMessage | None = None
        self._newest: tuple[JointState, Imu, FootForces] | None = None
        if self._emergency_stop.engaged:  # another world is no release
            self._on_emergency_stop(self._emergency_stop.word)

    def measure(self) -> None:
        """Read the sensors; their answer is due in the tick after this one."""
        sensors = self._node.world.sensors(self._robot)
        self._newest, self._newest_stamp = sensors_to_messages(sensors, self._cells), sensors.stamp

    def send(self) -> None:
        """Send what was measured, for the first time or again."""
        if self._newest is not None:
            joints, imu, forces = self._newest
            self._joints.publish(joints)
            self._imu.publish(imu)
            self._forces.publish(forces)

    @property
    def answered(self) -> bool:
        """Whether the answer to the sensors of the tick before is in, if there were any."""
        if self._asked is None:
            return True
        return self._answer is not None and stamp_of(self._answer) >= self._asked

    def obey(self) -> None:
        """Give the answer to the joints, and ask for the next."""
        if not self.answered:
            self._late += 1
        if self._answer is not None:
            self._apply(self._answer)
            self._answer = None
        self._asked = self._newest_stamp

    def _command_health(self) -> Finding | None:
        """Tell how the joints are commanded: too late, or not at all any more."""
        late, self._late = self._late, 0
        silent = silent_joints(self._node.world.silent_joints(self._robot), self._name)
        if silent is not None:
            return silent
        if not late:
            return None
        self._node.health.count("late answers", times=late)
        return Finding(
            Level.WARNING,
            f"{self._name}{late} leg commands came too late in the last second: free the processor for motion",
        )

    def _emergency_stop_health(self) -> Finding | None:
        """Tell of an emergency stop."""
        found = self._emergency_stop.finding()
        return None if found is None else Finding(found.level, f"{self._name}{found.words}")

    def _on_emergency_stop(self, word: StopWord) -> None:
        robot = self._node.world.robots[self._robot]
        if word.engaged:
            robot.limp(str(word))
        else:
            robot.release()

    def _is_from_before(self, message: JointCommandMessage) -> bool:
        """Tell whether a command answers sensors that are still to come: it was on its way when time began anew."""
        return stamp_of(message) > self._node.world.stamp

    def _on_legs(self, message: JointCommandMessage) -> None:
        if self._is_from_before(message):
            return
        self._answer = message
        self._node.heard_legs()

    def _on_head(self, message: JointCommandMessage) -> None:
        if not self._is_from_before(message):
            self._apply(message)

    def _apply(self, message: JointCommandMessage) -> None:
        reason = self._node.world.apply(joint_command_from_message(message), self._robot)
        if reason and not self._emergency_stop.engaged:
            self._node.health.count("refused joint commands", f"joint command refused: {reason}")


class RobotPort:
    """One robot of the world: its joints, and its pictures and truth on topics."""

    def __init__(
        self, node: SimulatorNode, robot: int, namespace: str, camera: CameraParameters, joints: Joints
    ) -> None:
        """Connect.

        Args:
            node: Owns the world.
            robot: Number in the world.
            namespace: Of the robot's topics, below the node's own; "" for none.
            camera: How the robot's camera sees.
            joints: The way of its sensors and commands.
        """
        self._node, self._robot, self.joints = node, robot, joints
        self._lens = head_camera_lens()
        self._camera = CameraRenderer(camera, load_field(), load_robot(), self._lens)
        outputs = (topics.CAMERA_IMAGE, topics.CAMERA_COMPRESSED, topics.GROUND_TRUTH, topics.CAMERA_INFO)
        senders = [node.sender(topic.within(namespace)) for topic in outputs]
        self._pictures, self._compressed, self._truth, self._lens_sender = senders

    def begin_anew(self, seed: int | list[int]) -> None:
        """Wait for the first command; the seed is that of the pictures' noise."""
        self._rng = np.random.default_rng(seed)
        self._lens_sender.publish(lens_to_message(self._lens, 0))
        self.joints.begin_anew()

    def tell_truth(self, truth: Truth, verdict: Verdict) -> None:
        """Publish what really is."""
        self._truth.publish(truth_to_message(truth, verdict))

    def take_picture(self) -> None:
        """Publish what the camera sees."""
        truth = self._node.world.truth(self._robot)
        picture = self._camera.render(truth, self._rng)
        self._pictures.publish(picture_to_message(picture, truth.stamp))
        if self._compressed.get_subscription_count() > 0:
            self._compressed.publish(jpeg_to_message(picture, truth.stamp))


class SimulatorNode(ComponentNode, ABC):
    """Owns a world and its time. Who inherits makes the world, and judges."""

    world: World

    def prepare(
        self,
        settings: SimulatorParameters,
        robots: Sequence[tuple[str, CameraParameters]],
        joints: Callable[[SimulatorNode, int, str], Joints] = TopicJoints,
        tells_time: bool = True,
    ) -> None:
        """Connect robots.

        Args:
            settings: How to run.
            robots: Namespace and camera of each, in the order of the world.
            joints: Makes the way of a robot's sensors and commands, from the node, its number and namespace.
            tells_time: Whether to send /clock.
        """
        self._pace_settings = settings
        self._clock_sender = self.sender(topics.CLOCK) if tells_time else None
        self._ports = [
            RobotPort(self, index, namespace, camera, joints(self, index, namespace))
            for index, (namespace, camera) in enumerate(robots)
        ]

    def begin_world(self, world: World, seeds: Sequence[int | list[int]]) -> None:
        """Begin anew with a world, and with the seeds of each robot's pictures."""
        self.world = world
        for port, seed in zip(self._ports, seeds, strict=True):
            port.begin_anew(seed)
        self._tick = 0
        self._waits = self._pace_settings.mode == "sync"
        self._started = False
        self._paced_from = (time.monotonic(), 0)

    @abstractmethod
    def judge(self, spin: Spin) -> Sequence[tuple[Truth, Verdict]]:
        """Let the referee see what is; return the truth about each robot and what there is to say of it.

        Args:
            spin: Waits for messages.
        """

    @property
    def interrupted(self) -> bool:
        """Whether waiting for answers shall end, because another world was wished for. To override."""
        return False

    def advance(self, spin: Spin) -> None:
        """Let one control tick pass.

        Args:
            spin: Waits up to so many seconds [s] for messages and handles them.
        """
        for port in self._ports:
            port.joints.measure()
        if self._tick == 0:
            self._await_nodes(spin)
        for port in self._ports:
            port.joints.send()
        spin(0.0)
        if self._waits:
            self._await_answers(spin)
        for port in self._ports:
            port.joints.obey()
        self.world.advance(TICK)
        verdicts = self.judge(spin)
        if self._tick % SLOW_TICKS == 0:
            if self._clock_sender is not None:
                self._clock_sender.publish(Clock(clock=to_message(self.world.stamp)))
            for port, (truth, verdict) in zip(self._ports, verdicts, strict=True):
                port.tell_truth(truth, verdict)
        if self._pace_settings.camera:
            for index, port in enumerate(self._ports):
                due = (self._tick - index * CAMERA_TICKS // len(self._ports)) % CAMERA_TICKS == 0
                if due and self.world.robots[index].faults.sees(self.world.stamp):
                    port.take_picture()
        self._tick += 1
        self._pace(spin)

    def heard_legs(self) -> None:
        """Wait for answers again, if time went on without."""
        if not self._waits and self._pace_settings.mode == "sync":
            self._waits = True
            self._paced_from = (time.monotonic(), self.world.stamp)

    def _await_nodes(self, spin: Spin) -> None:
        """Wait until the nodes of `wait_for` are in the graph, so that time begins with whole robots.

        A recorder is there once it serves: by then it surely hears the nodes that it was told to wait for.
        """
        p, own = self._pace_settings, self.get_namespace().rstrip("/")
        begin = time.monotonic()
        missing = {f"{own}/{name}" for name in p.wait_for}
        while missing and time.monotonic() - begin < p.start_bound:
            spin(REPEAT)
            present = {f"{space.rstrip('/')}/{name}" for name, space in self.get_node_names_and_namespaces()}
            if f"{own}/{topics.START_RECORDING.name}" not in dict(self.get_service_names_and_types()):
                present.discard(f"{own}/recorder")
            missing -= present
        if missing:
            names = ", ".join(sorted(name.removeprefix(f"{own}/") for name in missing))
            self.health.count("started without nodes", f"time begins without {names}")
        self._paced_from = (time.monotonic(), self.world.stamp)

    def _await_answers(self, spin: Spin) -> None:
        """Wait for the answers to the sensors of the tick before; the newest ones are already out."""
        p = self._pace_settings
        begin = time.monotonic()
        bound = p.answer_bound if self._started else p.start_bound
        repeat = begin + REPEAT
        while not self.interrupted and not all(port.joints.answered for port in self._ports):
            now = time.monotonic()
            if now - begin > bound:
                # From here on time follows the wall clock, as it would on the robot, until answers come again.
                self.health.count("ticks without an answer", "no leg command comes: the simulation goes on without")
                self._waits = False
                return
            if now > repeat:
                # Motion control may have been restarted: what it missed would never be answered.
                for port in self._ports:
                    port.joints.send()
                repeat = now + REPEAT
            spin(min(REPEAT, bound))
        self._started = self._started or self._tick > 0

    def _pace(self, spin: Spin) -> None:
        """Keep to the wall clock: never faster than `speed`, and without catching up when it was slower."""
        wanted = self._pace_settings.speed
        speed = wanted if self._waits or self._pace_settings.mode == "free" else 1.0
        if speed == 0.0:
            return
        wall, stamp = self._paced_from
        due = wall + (self.world.stamp - stamp) * 1e-9 / speed
        ahead = due - time.monotonic()
        if ahead < -LAG:
            self._paced_from = (time.monotonic(), self.world.stamp)
        while ahead > 0.0:
            spin(ahead)
            ahead = due - time.monotonic()
