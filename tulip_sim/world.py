"""The simulated world: physics at 1 kHz, one robot or several and a ball on the field, and the truth about them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from tulip_description.field import Field, load_field
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.quaternion import Quaternion
from tulip_description.robot import Robot, load_robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_sim.driver import MILLISECOND
from tulip_sim.engine import Layout, make_physics
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.simulated_robot import SimulatedRobot, as_drawn
from tulip_sim.touches import TouchCounter
from tulip_sim.truth import OtherRobot, Truth

CONTACT_PERIOD = 4  # [ms] between looks at who touches the ball; a kick's contact lasts about 17 ms
KEEPER = 0  # its number among the figures


class World:
    """Robots, a ball and perhaps a keeper's figure on the field.

    The robots start at rest, their soles on the ground, and hold their posture until the first commands come. Physics
    and joint loop run at 1 kHz. The same scenario, parameters, seed and commands give the same truth, bit for bit, on
    one machine. Where a method takes the number of a robot, 0 is the scenario's `robot`, 1 the first of its `others`.

    Args:
        scenario: What stands where at the start.
        parameters: Physics and sensors.
        seed: Of everything random: masses, friction, sensor errors; each robot has its own.
        field: Geometry of the field; None for the project's own.
        robot: What the robots are like, as motion control may know; None for the playing robot.
        joint_positions: (n,) posture at the start [rad], feet flat; None for `standing_posture`.
        tilt: Quaternion x, y, z, w of the robots' trunks in that posture, without a heading; None: upright.
        true_body: Whose masses, CoMs and inertias the robots really have, before the parameters' random changes; None
            for those of `robot`.

    Raises:
        ValueError: if joint_positions has a wrong shape, the feet of that posture are not on level ground, or true_body
            is of another shape than robot.
    """

    def __init__(
        self,
        scenario: Scenario,
        parameters: WorldParameters | None = None,
        seed: int = 0,
        field: Field | None = None,
        robot: Robot | None = None,
        joint_positions: ArrayLike | None = None,
        true_body: Robot | None = None,
        tilt: Quaternion | None = None,
    ) -> None:
        self.scenario = scenario
        self.parameters = parameters if parameters is not None else WorldParameters()
        self.field = field if field is not None else load_field()
        self.robot = robot if robot is not None else load_robot()
        seeds = np.random.default_rng(seed)
        poses = (scenario.robot, *scenario.others)
        rngs = [(physics_rng, sensor_rng) for physics_rng, sensor_rng in (seeds.spawn(2) for _ in poses)]
        start = standing_posture(self.robot).joint_positions if joint_positions is None else np.array(joint_positions)
        p = self.parameters
        self._now = 0
        self.friction = float(rngs[0][0].uniform(*p.friction))
        """Of the carpet, as drawn."""
        figures = (() if scenario.keeper is None else (scenario.keeper.pose,)) + scenario.obstacles
        really = tuple(as_drawn(self.robot, p, rng, true_body) for rng, _ in rngs)
        self.physics = make_physics(Layout(self.field, p, self.friction, scenario.poles, figures, really))
        """The engine."""
        self._keeper_pose = None if scenario.keeper is None else scenario.keeper.pose
        self._keeper_touches = TouchCounter()
        self.robots = tuple(
            SimulatedRobot(self.robot, body, p, start, pose, rng, tilt)
            for body, pose, rng in zip(self.physics.robots, poses, rngs, strict=True)
        )
        self.place_ball(*scenario.ball)

    @property
    def stamp(self) -> int:
        """Time since the start [ns]."""
        return self._now

    def apply(self, command: JointCommand, robot: int = 0) -> str:
        """Give a command to a robot's driver; it acts from the next millisecond on.

        Returns:
            "" if the driver took it, else the reason why it did not.
        """
        return self.robots[robot].accept(command, self._now)

    def silent_joints(self, robot: int = 0) -> tuple[str, ...]:
        """Return a robot's joints whose last command outlived its time-to-live."""
        return self.robots[robot].silent_joints(self._now)

    def advance(self, milliseconds: int) -> None:
        """Let time pass.

        Raises:
            ValueError: if milliseconds is negative.
        """
        if milliseconds < 0:
            raise ValueError(f"milliseconds is {milliseconds}; expected >= 0")
        for _ in range(milliseconds):
            for robot in self.robots:
                robot.drive(self._now)
            self._move_keeper()
            self.physics.step()
            self._now += MILLISECOND
            for robot in self.robots:
                robot.read_joints()
            if self._now // MILLISECOND % CONTACT_PERIOD == 0:
                self._count_touches()
            for robot in self.robots:
                robot.measure(self._now)

    def sensors(self, robot: int = 0) -> Sensors:
        """Return a robot's newest reading that has arrived by now."""
        return self.robots[robot].sensors(self._now)

    def truth(self, robot: int = 0) -> Truth:
        """Return what really is; the robot of that number is the one that the truth is about."""
        own = self.robots[robot]
        position, orientation, rotation = own.body.base_pose()
        linear, angular = own.body.base_velocity(rotation)
        ball = self.physics.ball()
        keeper = self.scenario.keeper
        others = [
            OtherRobot(*other.body.base_pose()[:2], other.joint_positions) for other in self.robots if other is not own
        ]
        return Truth(
            stamp=self._now,
            base_position=position,
            base_orientation=orientation,
            base_linear_velocity=linear,
            base_angular_velocity=angular,
            joint_positions=own.joint_positions,
            joint_velocities=own.joint_velocities,
            ball_position=ball.position,
            ball_orientation=ball.orientation,
            ball_linear_velocity=ball.linear_velocity,
            ball_angular_velocity=ball.angular_velocity,
            keeper=self._keeper_pose,
            keeper_path=() if keeper is None or not keeper.path else keeper.points,
            foot_touches=own.foot_touches,
            body_touches=own.body_touches,
            keeper_touches=self._keeper_touches.count,
            poles=self.scenario.poles,
            others=tuple(others),
            obstacles=self.scenario.obstacles,
        )

    def push(self, force: ArrayLike, milliseconds: int, robot: int = 0) -> None:
        """Push a robot's trunk at its centre of mass.

        Args:
            force: (3,) in map [N].
            milliseconds: How long, from now on; a new push ends the last one.
            robot: Its number.

        Raises:
            ValueError: if force is not three finite numbers or milliseconds is not positive.
        """
        self.robots[robot].push(force, milliseconds, self._now)

    def place_ball(self, x: float, y: float, vx: float = 0.0, vy: float = 0.0) -> None:
        """Put the ball on the ground, rolling.

        Args:
            x: In map [m].
            y: In map [m].
            vx: Speed along x [m/s].
            vy: Speed along y [m/s].

        Raises:
            ValueError: if a number is not finite.
        """
        if not all(math.isfinite(value) for value in (x, y, vx, vy)):
            raise ValueError(f"ball is at ({x}, {y}) m with ({vx}, {vy}) m/s; expected finite numbers")
        radius = self.field.ball_radius
        self.physics.place_ball(
            np.array([x, y, radius]), np.array([vx, vy, 0.0]), np.array([-vy / radius, vx / radius, 0.0])
        )

    def set_upright(self, pose: Pose2D | None = None, robot: int = 0) -> None:
        """Set a robot on its feet in its start posture, at rest, as a referee's hands would, and let go.

        Args:
            pose: Where base_link shall stand, in map; None for where the robot is, with the heading that it has.
            robot: Its number.

        Raises:
            ValueError: if a number is not finite.
        """
        self.robots[robot].set_upright(pose, self._now)

    def close(self) -> None:
        """Free the physics engine; the world cannot be used afterwards."""
        self.physics.close()

    def _move_keeper(self) -> None:
        """Put the keeper's figure where it is in the next millisecond."""
        keeper, pose = self.scenario.keeper, self._keeper_pose
        if keeper is None or pose is None or not keeper.moves:
            return
        if keeper.path:
            pose = keeper.pose_at(self._now + MILLISECOND)
        else:
            pose = keeper.after(pose, float(self.physics.ball().position[1]), 1e-3)
        self._keeper_pose = pose
        self.physics.move_figure(KEEPER, pose)

    def _count_touches(self) -> None:
        """Count who has come to touch the ball in this step."""
        for robot in self.robots:
            robot.count_touches(self._now)
        if self.scenario.keeper is not None and self.physics.figure_at_ball(KEEPER):
            self._keeper_touches.touch(self._now)
