"""Node "worldmodel": odometry and features in; world_state, robot_pose and the transform map to odom out."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import Odometry as OdometryMessage

from tulip_description.field import FieldError, load_field
from tulip_description.planar import Pose2D
from tulip_description.quaternion import pose_on_ground
from tulip_motion.interface import Odometry
from tulip_motion.messages import odometry_from_message
from tulip_msgs.msg import Features as FeaturesMessage
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.run import ComponentNode, run
from tulip_ros.time import stamp_of
from tulip_worldmodel.messages import (
    features_from_message,
    map_to_odom_message,
    robot_pose_to_message,
    start_pose_from_message,
    world_state_to_message,
)
from tulip_worldmodel.rejected import Rejected
from tulip_worldmodel.world_model import WorldModel, WorldModelParameters


@dataclass(frozen=True)
class WorldModelNodeParameters(WorldModelParameters):
    """Parameters of the world model and of its node."""

    start_x: float = -1.5  # [m] base_footprint in map when the node starts: where a person puts the robot
    start_y: float = 0.0  # [m]
    start_yaw: float = 0.0  # [rad]
    field_file: str = ""  # "" for the AdultSize field of 2013
    field_turned: bool = False  # the team attacks the goal at -x of the file, so its map is turned by half a circle
    publish_period: float = 0.02  # [s] between two world states without a new picture: one with news goes out at once


class WorldModelNode(ComponentNode):
    """Turns messages into calls of the world model and its answers into messages."""

    def __init__(self) -> None:
        """Make the core and connect it."""
        super().__init__("worldmodel")
        p = self._settings = self.load(WorldModelNodeParameters())
        self._start = Pose2D(p.start_x, p.start_y, p.start_yaw)
        self._before: dict[str, Any] = {}
        self.begin_anew()
        self._before = self.keepsake.read()  # where the robot was when this node died
        # Stamp [ns], x, y [m] and yaw [rad] of the start pose that was used last, and that comes once more if latched.
        self._told = self._latched = self._before.get("told", [])
        self._world_state = self.sender(topics.WORLD_STATE)
        self._robot_pose = self.sender(topics.ROBOT_POSE)
        self._transforms = self.sender(topics.TF)
        self.listen(topics.ODOMETRY, self._on_odometry)
        self.listen(topics.FEATURES, self._on_features)
        self.listen(topics.START_POSE, self._on_start_pose)

    def begin_anew(self) -> None:
        """Make the core, which starts where the robot was set down last."""
        p = self._settings
        try:
            field = load_field(p.field_file or None)
        except FieldError as error:
            raise BadInputError(f"Parameter field_file of node 'worldmodel': {error}") from error
        self._world = WorldModel(p, field.turned() if p.field_turned else field, self._start)
        self._before = {}  # counts no more
        self._last_published: int | None = None  # stamp [ns]
        self._newest: int | None = None  # stamp of the newest odometry [ns]

    def _on_odometry(self, message: OdometryMessage) -> None:
        stamp, odometry = stamp_of(message), odometry_from_message(message)
        if self._newest is None:
            self._go_on_from_before(odometry)
        self._world.add_odometry(odometry)
        published = self._last_published
        if published is None or stamp - published >= self._settings.publish_period * 1e9:
            self._publish(stamp)
        self._newest = stamp

    def _on_features(self, message: FeaturesMessage) -> None:
        rejected = self._world.add_features(features_from_message(message))
        for entry in rejected:
            if entry.feature is None:
                self.health.count("pictures not used", f"picture not used: {entry.reason}")
            self.get_logger().debug(describe(entry))
        if self._newest is not None:
            self._publish(self._newest)

    def _on_start_pose(self, message: PoseWithCovarianceStamped) -> None:
        pose = start_pose_from_message(message)
        if pose is None:
            self.health.count("bad start poses", "initialpose holds no pose on the ground; expected finite numbers")
            return
        latched, self._latched = self._latched, []
        self._start, self._told = pose, [stamp_of(message), *pose.as_array().tolist()]
        if self._told != latched:  # else it was used before this node died
            self.begin_anew()

    def _go_on_from_before(self, odometry: Odometry) -> None:
        """Begin where the robot has come to since this node died; where it was set down if time began anew."""
        before, start = self._before, self._start
        if not before:
            return
        if odometry.stamp >= before["stamp"]:
            then, in_map = (Pose2D(*before[name]) for name in ("odom", "map"))
            self._start = in_map @ then.inverse() @ pose_on_ground(odometry.position, odometry.orientation)
        self.begin_anew()
        self._start = start

    def _publish(self, stamp: int) -> None:
        self._last_published = stamp
        world = self._world.state(stamp)
        self._world_state.publish(world_state_to_message(world))
        robot = world.robot
        poses = {"map": robot.pose.as_array().tolist(), "odom": robot.pose_in_odom.as_array().tolist()}
        self.keepsake.keep({"stamp": world.stamp, "told": self._told, **poses})
        self._robot_pose.publish(robot_pose_to_message(world))
        self._transforms.publish(map_to_odom_message(world))


def describe(rejected: Rejected) -> str:
    """Return one line about what was not used."""
    what = "picture" if rejected.feature is None else rejected.feature.kind.name.lower()
    return f"{what} at {rejected.stamp} ns not used: {rejected.reason}"


def main() -> None:
    """Run the node."""
    run(WorldModelNode)


if __name__ == "__main__":
    main()
