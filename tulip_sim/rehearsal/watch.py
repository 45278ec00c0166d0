"""What a motion does to the robot, tick by tick: torques, speeds, centre of pressure, room between the legs."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from tulip_description import frames
from tulip_description.model import floating_model
from tulip_description.robot import Robot
from tulip_description.robot_io import Sensors
from tulip_motion.identification.self_collision import SelfCollision
from tulip_motion.saturation import AT_LIMIT
from tulip_sim.timing import TICK
from tulip_sim.world import World

Array = NDArray[np.float64]
CARRIES = 40.0  # [N] on a sole from which it counts as a foot that stands, as motion control has it
CLEARANCE_TICKS = 5  # between looks at the room between the legs
NEVER = math.inf


@dataclass
class Course:
    """One play of a motion.

    Attributes:
        seed: Of the simulated robot's masses, friction and sensor errors.
        times: (t,) since the start [s].
        torques: (t, n) mean torque of each tick as a share of the joint's limit, with its sign.
        speeds: (t, n) as a share of the joint's limit, with its sign.
        margins: (t,) from the centre of pressure to the nearest edge of the support polygon [m]; NaN where no foot
            carries.
        tilts: (t,) of the trunk [rad].
        clearance: Least distance between a leg and another part [m], and which two.
        beginnings: When each part began [s], and its words.
        fall: Why the robot fell, or "".
        refusals: What motion control did not do, in words.
        notes: What else it said, in words.
    """

    seed: int
    times: Array
    torques: Array
    speeds: Array
    margins: Array
    tilts: Array
    clearance: tuple[float, str]
    beginnings: list[tuple[float, str]] = field(default_factory=list)
    fall: str = ""
    refusals: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def saturated(self) -> Array:
        """(n,) share of the time in which each joint gave all its torque."""
        return np.asarray((np.abs(self.torques) >= AT_LIMIT).mean(axis=0))


class Watch:
    """Looks at a world with one robot after each control tick.

    Args:
        world: In which the motion is played.
        seed: That the world was made with.
    """

    def __init__(self, world: World, seed: int) -> None:
        self._world, self._seed = world, seed
        robot = world.robot
        self._efforts, self._velocities = robot.effort_limits, robot.velocity_limits
        self._polygon = SupportPolygon(robot)
        self._collision = SelfCollision(robot)
        self._rows: list[tuple[Array, Array, float, float]] = []
        self._clearance = (NEVER, "")
        self.beginnings: list[tuple[float, str]] = []
        self.refusals: list[str] = []
        self._notes: dict[str, str] = {}

    @property
    def time(self) -> float:
        """Watched so far [s]."""
        return len(self._rows) * TICK / 1000.0

    def begin(self, words: str) -> None:
        """Note that a part begins."""
        self.beginnings.append((self.time, words))

    def note(self, *notes: str) -> None:
        """Keep what motion control says, once of each kind."""
        for note in notes:
            self._notes.setdefault(note.partition(":")[0], note)

    def look(self, sensors: Sensors) -> None:
        """Take a tick.

        Args:
            sensors: The newest reading: its torques are means over the time since the one before.
        """
        body = self._world.robots[0]
        _, orientation, rotation = body.body.base_pose()
        contacts = (body.body.sole_contacts(0), body.body.sole_contacts(1))
        margin = self._polygon.margin(orientation, body.joint_positions, contacts)
        tilt = math.acos(max(-1.0, min(1.0, float(rotation[2, 2]))))
        if len(self._rows) % CLEARANCE_TICKS == 0:
            self._clearance = min(self._clearance, self._collision.clearance(body.joint_positions))
        self._rows.append(
            (sensors.joint_efforts / self._efforts, body.joint_velocities / self._velocities, margin, tilt)
        )

    def course(self, fall: str) -> Course:
        """Return what was seen.

        Args:
            fall: Why the robot fell, or "".
        """
        torques, speeds, margins, tilts = (np.array(column) for column in zip(*self._rows, strict=True))
        times = np.arange(len(self._rows)) * TICK / 1000.0
        return Course(
            *(self._seed, times, torques, speeds, margins, tilts, self._clearance),
            *(self.beginnings, fall, self.refusals, list(self._notes.values())),
        )


class SupportPolygon:
    """The hull of the soles that carry weight, and how far inside of it the centre of pressure is.

    The centre of pressure of a robot on level ground is its zero-moment point. It is inside by nature: on the edge the
    robot begins to tip over it.

    Args:
        robot: Its legs and soles.
    """

    def __init__(self, robot: Robot) -> None:
        self._model = floating_model(robot)
        self._data = self._model.createData()
        self._soles = [self._model.getFrameId(name) for name in (frames.LEFT_SOLE, frames.RIGHT_SOLE)]
        self._corners = [foot.corners for foot in robot.feet]
        self._q = np.zeros(self._model.nq)

    def margin(
        self, orientation: Array, joint_positions: Array, contacts: tuple[list[tuple[float, float, float]], ...]
    ) -> float:
        """Return the distance from the centre of pressure to the nearest edge [m]; NaN where no foot carries.

        Args:
            orientation: (4,) quaternion of base_link.
            joint_positions: (n,) [rad].
            contacts: Of the left and the right sole: x, y in the sole frame [m] and force [N] of each point.
        """
        points = [np.array(each).reshape(-1, 3) for each in contacts]
        standing = [side for side in (0, 1) if points[side][:, 2].sum() >= CARRIES]
        if not standing:
            return math.nan
        self._q[3:7], self._q[7:] = orientation, joint_positions
        pin.framesForwardKinematics(self._model, self._data, self._q)
        corners, places, forces = [], [], []
        for side in standing:
            sole = self._data.oMf[self._soles[side]]
            turn, origin = sole.rotation[:2, :2], sole.translation[:2]
            corners.append(self._corners[side][:, :2] @ turn.T + origin)
            places.append(points[side][:, :2] @ turn.T + origin)
            forces.append(points[side][:, 2])
        weights = np.concatenate(forces)
        centre = weights @ np.concatenate(places) / weights.sum()
        edges = ConvexHull(np.concatenate(corners)).equations  # (e, 3): outward normal, and offset
        return float(-(edges[:, :2] @ centre + edges[:, 2]).max())
