"""Where the body is: base pose from the IMU and the stance leg, CoM from the model, smoothed by the pendulum.

The stance sole is taken to be on the ground where it landed. A foot that is pushed onto its edge rolls about its centre
of pressure, and one that twists turns about the pivot that GroundTrack finds; were its origin taken to stand still, the
body would seem to move. The IMU gives the attitude and the heading, so only the stance foot's slip and the landing
pose's error add up in the position.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.planar import Pose2D
from tulip_description.quaternion import Quaternion, quaternion_product, quaternion_yaw
from tulip_description.robot_io import Sensors
from tulip_motion.footsteps import Footstep
from tulip_motion.interface import Side
from tulip_motion.lipm import GRAVITY, time_constant
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]
Point = tuple[float, float, float]
Point2D = tuple[float, float]


class Sole(NamedTuple):
    """Where a sole is, in odom; plain numbers, since every tick reckons with them.

    Attributes:
        position: (x, y, z) [m].
        axes: 3 x 3 from the sole's axes to odom's, by rows.
    """

    position: Sequence[float]
    axes: Sequence[Sequence[float]]

    @property
    def pose(self) -> Pose2D:
        """As seen from above."""
        (c, _, _), (s, _, _), _ = self.axes
        return Pose2D(self.position[0], self.position[1], math.atan2(s, c))

    @property
    def transform(self) -> Array:
        """(4, 4) from the sole to odom."""
        transform = np.eye(4)
        transform[:3, :3], transform[:3, 3] = self.axes, self.position
        return transform


class Estimate(NamedTuple):
    """The body at one instant, in odom.

    Attributes:
        base_position: (3,) of base_link [m].
        base_rotation: (3, 3) from base_link to odom.
        base_velocity: (3,) of base_link, odom axes [m/s].
        angular_velocity: (3,) of base_link, odom axes [rad/s].
        joint_positions, joint_velocities: (12,) [rad], [rad/s].
        com, com_velocity: (3,) smoothed by the observer [m], [m/s].
        dcm: (x, y) of the divergent component of motion, c + Tc c' [m]; plain numbers, since much is reckoned from it.
        soles: The left and the right one.
        sole_yaw_rates: At which the left and the right sole turn, by gyro and joints [rad/s]; 0 in the air.
        pressures: On the left and right sole: force [N], and the force times its centre, forward and left [N m].
        loads: Vertical force on the left and right sole [N].
        tilt: Angle between the torso and the vertical [rad].
    """

    base_position: Array
    base_rotation: Array
    base_velocity: Array
    angular_velocity: Array
    joint_positions: Array
    joint_velocities: Array
    com: Array
    com_velocity: Array
    dcm: tuple[float, float]
    soles: tuple[Sole, Sole]
    sole_yaw_rates: tuple[float, float]
    pressures: Sequence[Point]
    loads: tuple[float, float]
    tilt: float

    def sole_pose(self, side: Side) -> Pose2D:
        """Return where a sole is, seen from above."""
        return self.soles[side].pose

    @property
    def base_footprint(self) -> Pose2D:
        """Where base_footprint is in odom."""
        yaw = math.atan2(self.base_rotation[1, 0], self.base_rotation[0, 0])
        return Pose2D(float(self.base_position[0]), float(self.base_position[1]), yaw)


class StateEstimator:
    """Says where the body is, from where the soles stand and what IMU and joints say."""

    def __init__(self, parameters: MotionParameters, model: Any, cell_positions: Array) -> None:
        """Make an estimator.

        Args:
            parameters: Of motion control.
            model: Pinocchio model of the legs with a free flyer at base_link.
            cell_positions: (2, 4, 2) force cells in the left and right sole frame [m].
        """
        self._parameters = parameters
        self._time_constant = time_constant(parameters.com_height)
        self._model = model
        data = self._data = model.createData()
        self._sole_frames = (model.getFrameId(frames.LEFT_SOLE), model.getFrameId(frames.RIGHT_SOLE))
        self._cells = cell_positions.tolist()
        self._configuration = pin.neutral(model)
        self._velocity = np.zeros(model.nv)
        # Views into Pinocchio's data, made once: making one takes as long as what is done with it.
        self._model_com, self._model_com_velocity = data.com[0], data.vcom[0]
        self._base_rotation = data.oMi[1].rotation
        soles = [data.oMf[frame] for frame in self._sole_frames]
        self._soles = tuple((sole.translation, sole.rotation) for sole in soles)
        self._heading_offset: Quaternion | None = None
        self._comes_from: Point2D | None = None  # [m] where base_link is at the first update, if that is known
        self._tilt_bias = (0.0, 0.0)  # [rad] of the IMU about the x and y axis of base_link
        self._begins = True
        dt, position_share = parameters.control_period, parameters.control_period * parameters.observer_position_gain
        velocity_share = dt * parameters.observer_velocity_gain
        self._observer = np.array(
            (
                (1.0 - position_share, dt, position_share, 0.0, 0.0),
                (0.0, 1.0 - velocity_share, 0.0, velocity_share, dt),
            )
        )
        # What the observer's next state is made of: CoM, its velocity, both as measured, acceleration; (3,) each.
        self._observed = np.zeros((5, 3))
        self._com_state, self._measured_com, self._measured_velocity = (self._observed[i] for i in (slice(2), 2, 3))
        self.anchors: list[Pose2D] = [Pose2D(), Pose2D()]
        """Where the left and the right sole stand, or were put down last, in odom."""
        self.shift = (0.0, 0.0)
        """How far the body has moved by slips of the feet since they were put down, in odom [m]."""
        self.pivots = [(0.0, 0.0), (0.0, 0.0)]
        """The point of the left and the right sole that stays when the sole twists, in its axes [m]."""

    def anchor(self, foot: Footstep) -> None:
        """Take a foot to be fixed on the ground at its pose from now on."""
        self.anchors[foot.side] = foot.pose

    @property
    def heading_offset(self) -> float:
        """Heading of base_link in odom less that of the IMU [rad]; 0 before the first update."""
        return 0.0 if self._heading_offset is None else quaternion_yaw(self._heading_offset)

    def continue_from(self, heading_offset: float, base: Point2D) -> None:
        """Go on in another estimator's odom; call before the first update.

        Args:
            heading_offset: Of the other one [rad].
            base: Where it had base_link, seen from above [m].
        """
        half = 0.5 * heading_offset
        self._heading_offset, self._comes_from = (0.0, 0.0, math.sin(half), math.cos(half)), base

    def restart(self) -> None:
        """Forget the CoM's motion; the next update begins with the feet where they are measured."""
        self._begins = True
        self.shift = (0.0, 0.0)

    def update(self, sensors: Sensors, left_weight: float, acceleration: Array) -> Estimate:
        """Return the state of the body.

        Args:
            sensors: The newest reading.
            left_weight: 1 when the left foot fixes the body, 0 when the right does, between in double support.
            acceleration: (3,) acceleration of the CoM that the last command asked for, odom axes [m/s^2].
        """
        q, v = self._configuration, self._velocity
        q[3:7] = self._attitude(sensors)
        joint_positions, joint_velocities = sensors.joint_positions[:12], sensors.joint_velocities[:12]
        q[7:] = joint_positions
        v[3:6] = sensors.imu_angular_velocity  # the axes of imu_link are those of base_link
        v[6:] = joint_velocities
        model, data = self._model, self._data
        # The base stays at the origin and at rest: where it is and how it moves follows from the feet.
        pin.centerOfMass(model, data, q, v, False)
        left_frame, right_frame = self._sole_frames
        pin.updateFramePlacement(model, data, left_frame)
        pin.updateFramePlacement(model, data, right_frame)
        (left_place, left_axes), (right_place, right_axes) = self._soles
        left = Sole(left_place.tolist(), left_axes.tolist())
        right = Sole(right_place.tolist(), right_axes.tolist())
        if self._begins:
            self._begin(left.pose, right.pose)
        cells_left, cells_right = sensors.foot_cells.tolist()
        pressures = (_pressure(cells_left, self._cells[0]), _pressure(cells_right, self._cells[1]))
        loads = (pressures[0][0], pressures[1][0])
        position, velocity, yaw_rates = self._from_feet(left_weight, (left, right), pressures, loads)
        base_position, base_velocity = np.array(position), np.array(velocity)
        rotation = self._base_rotation.copy()
        if left_weight in (0.0, 1.0):
            self._learn_tilt_bias(left if left_weight == 1.0 else right, rotation)
        com, com_velocity, dcm = self._observe(base_position, base_velocity, self._felt(acceleration, loads))
        return Estimate(
            base_position,
            rotation,
            base_velocity,
            rotation.dot(sensors.imu_angular_velocity),
            joint_positions,
            joint_velocities,
            com,
            com_velocity,
            dcm,
            (_moved(left, position), _moved(right, position)),
            yaw_rates,
            pressures,
            loads,
            math.acos(min(max(rotation.item(8), -1.0), 1.0)),
        )

    def _attitude(self, sensors: Sensors) -> Quaternion:
        """Return the attitude of base_link; its heading counts from the one at the start."""
        attitude = sensors.imu_orientation.tolist()
        if self._heading_offset is None:
            half = -0.5 * quaternion_yaw(attitude)
            self._heading_offset = (0.0, 0.0, math.sin(half), math.cos(half))
        turned = quaternion_product(self._heading_offset, attitude)
        x, y = self._tilt_bias
        return quaternion_product(turned, (-0.5 * x, -0.5 * y, 0.0, math.sqrt(1.0 - 0.25 * (x * x + y * y))))

    def _learn_tilt_bias(self, sole: Sole, rotation: Array) -> None:
        """Take part of the tilt that a foot alone on level ground seems to have for the IMU's own.

        A mounting error of some milliradians would lean the torso, and ask the ankles for angles that the ground does
        not allow: no torque could then bring the joint error down.
        """
        p = self._parameters
        share, most = p.control_period / p.imu_bias_time, p.imu_bias_limit
        (_, _, about_y), (_, _, minus_about_x), _ = sole.axes
        about_x, c, s = -minus_about_x, rotation.item(0), rotation.item(3)
        x, y = self._tilt_bias
        x += share * (c * about_x + s * about_y)
        y += share * (c * about_y - s * about_x)
        self._tilt_bias = (min(max(x, -most), most), min(max(y, -most), most))

    def _from_feet(
        self, left_weight: float, soles: tuple[Sole, Sole], pressures: Sequence[Point], loads: tuple[float, float]
    ) -> tuple[Point, Point, tuple[float, float]]:
        """Return position [m] and velocity [m/s] of the base for which the feet that carry stay where they stand.

        The third is the yaw rate of the soles [rad/s], 0 of one in the air.

        Args:
            left_weight: As of `update`.
            soles: With the base at the origin.
            pressures: Of the left and right sole, see `_pressure`.
            loads: Vertical force on the left and right sole [N].
        """
        x = y = z = vx = vy = vz = 0.0
        rates = [0.0, 0.0]
        for side, weight in ((Side.LEFT, left_weight), (Side.RIGHT, 1.0 - left_weight)):
            carries = loads[side] > self._parameters.contact_force
            if weight == 0.0 and not carries:
                continue
            motion = pin.getFrameVelocity(self._model, self._data, self._sole_frames[side], pin.LOCAL_WORLD_ALIGNED)
            ux, uy, uz, wx, wy, wz = motion.vector.tolist()
            rates[side] = wz
            if weight == 0.0:
                continue
            (px, py, pz), ((xx, xy, _), (yx, yy, _), (zx, zy, _)) = soles[side]
            if carries:
                load, forward, left = pressures[side]
                forward, left = forward / load, left / load
                rx, ry, rz = xx * forward + xy * left, yx * forward + yy * left, zx * forward + zy * left
                along, across = self.pivots[side]
                twist = self._parameters.observer_twist_share * wz
                ux += wy * rz - twist * (yx * along + yy * across)
                uy += twist * (xx * along + xy * across) - wx * rz
                uz += wx * ry - wy * rx
                pz += rz
            anchor = self.anchors[side]
            x += weight * (anchor.x + self.shift[0] - px)
            y += weight * (anchor.y + self.shift[1] - py)
            z -= weight * pz
            vx -= weight * ux
            vy -= weight * uy
            vz -= weight * uz
        return (x, y, z), (vx, vy, vz), (rates[0], rates[1])

    def _begin(self, left: Pose2D, right: Pose2D) -> None:
        """Set the anchors such that the left foot stays where it was believed to be, the right beside it."""
        keep = self.anchors[Side.LEFT]
        if self._comes_from is not None:
            (x, y), self._comes_from = self._comes_from, None
            keep = Pose2D(x + left.x, y + left.y)
        elif keep == Pose2D():
            keep = left
        self.anchors = [Pose2D(keep.x, keep.y, left.yaw), keep_distance(keep, left, right)]

    def _felt(self, acceleration: Array, loads: tuple[float, float]) -> Array:
        """Return what the CoM can follow of a commanded acceleration: without contact it falls freely."""
        in_flight = loads[0] + loads[1] < self._parameters.contact_force
        return np.array((0.0, 0.0, -GRAVITY)) if in_flight else acceleration

    def _observe(self, position: Array, velocity: Array, acceleration: Array) -> tuple[Array, Array, Point2D]:
        """Predict the CoM with the commanded acceleration and pull it to the measured one; return also its DCM.

        The gains times the control period, as shares, stand in `_observer`.

        Args:
            position: (3,) of the base [m]; the model's CoM counts from there.
            velocity: (3,) of the base [m/s].
            acceleration: (3,) of the CoM, as commanded [m/s^2].
        """
        observed = self._observed
        np.add(self._model_com, position, out=self._measured_com)
        if self._begins:
            self._begins = False
            state = np.array((self._measured_com, (0.0, 0.0, 0.0)))
        else:
            np.add(self._model_com_velocity, velocity, out=self._measured_velocity)
            observed[4] = acceleration
            state = self._observer.dot(observed)
        self._com_state[:] = state
        (x, y, _), (vx, vy, _) = state.tolist()
        return state[0], state[1], (x + self._time_constant * vx, y + self._time_constant * vy)


def centre_of_pressure(estimate: Estimate, contact_force: float) -> Array:
    """Return (2,) where the cells' forces act together, in odom [m]; NaN when they add up to less than a force [N]."""
    total = sum(estimate.loads)
    if total < contact_force:
        return np.full(2, np.nan)
    x = y = 0.0
    for (load, forward, left), ((px, py, _), ((xx, xy, _), (yx, yy, _), _)) in zip(
        estimate.pressures, estimate.soles, strict=True
    ):
        x += load * px + xx * forward + xy * left
        y += load * py + yx * forward + yy * left
    return np.array((x / total, y / total))


def _pressure(forces: Sequence[float], places: Sequence[Sequence[float]]) -> Point:
    """Return the force on a sole [N], and its centre in the sole (forward, left) times the force [N m].

    Args:
        forces: On the four cells [N].
        places: Of the cells in the sole [m].
    """
    a, b, c, d = forces
    (ax, ay), (bx, by), (cx, cy), (dx, dy) = places
    return a + b + c + d, a * ax + b * bx + c * cx + d * dx, a * ay + b * by + c * cy + d * dy


def _moved(sole: Sole, way: Point) -> Sole:
    """Return a sole moved by a way [m]."""
    x, y, z = sole.position
    return Sole((x + way[0], y + way[1], z + way[2]), sole.axes)


def keep_distance(anchor: Pose2D, measured: Pose2D, other: Pose2D) -> Pose2D:
    """Return `other` moved by what moves `measured` onto `anchor`'s position; headings are absolute."""
    return Pose2D(anchor.x + other.x - measured.x, anchor.y + other.y - measured.y, other.yaw)
