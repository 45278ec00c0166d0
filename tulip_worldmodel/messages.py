"""Messages of the world model, from and to domain objects."""

from __future__ import annotations

import math

import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped, Quaternion, TransformStamped
from tf2_msgs.msg import TFMessage

from tulip_description.frames import MAP, ODOM
from tulip_description.planar import Pose2D
from tulip_description.quaternion import pose_on_ground
from tulip_msgs.msg import Features as FeaturesMessage
from tulip_msgs.msg import ObjectEstimate as ObjectEstimateMessage
from tulip_msgs.msg import WorldState as WorldStateMessage
from tulip_ros.time import header, stamp_of, to_message
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_worldmodel.world_state import ObjectEstimate, WorldState

PLANE = np.ix_((0, 1, 5), (0, 1, 5))
"""x, y and the rotation about z, among the six of a pose."""
FARTHEST = 100.0  # [m] from the field's middle; no hall is larger


def features_from_message(message: FeaturesMessage) -> Features:
    """Return the features of a message."""
    return Features(
        stamp=stamp_of(message),
        camera_position=np.array(message.camera_position, dtype=np.float64),
        view=np.array(message.view, dtype=np.float64),
        features=tuple(
            Feature(
                kind=FeatureClass(each.kind),
                azimuth=each.azimuth,
                elevation=each.elevation,
                azimuth_spread=each.azimuth_spread,
                elevation_spread=each.elevation_spread,
                confidence=each.confidence,
                end_azimuth=each.end_azimuth,
                end_elevation=each.end_elevation,
                angular_radius=each.angular_radius,
                side=each.side,
            )
            for each in message.features
        ),
    )


def world_state_to_message(world: WorldState) -> WorldStateMessage:
    """Return a world state as a message."""
    message = WorldStateMessage(header=header(world.stamp, MAP))
    message.picture = to_message(world.picture)
    message.robot_pose = world.robot.pose.as_array()
    message.robot_covariance = world.robot.covariance.ravel()
    message.robot_pose_in_odom = world.robot.pose_in_odom.as_array()
    message.ball_known = world.ball is not None
    if world.ball is not None:
        message.ball = object_to_message(world.ball)
    if (rest := world.ball_rest) is not None:
        message.ball_rest, message.ball_rest_after = rest.position, rest.after
    message.opponents = [object_to_message(opponent) for opponent in world.opponents]
    return message


def object_to_message(estimate: ObjectEstimate) -> ObjectEstimateMessage:
    """Return an object's estimate as a message."""
    return ObjectEstimateMessage(
        position=estimate.position,
        velocity=estimate.velocity,
        covariance=estimate.covariance.ravel(),
        position_in_map=estimate.position_in_map,
        velocity_in_map=estimate.velocity_in_map,
        age=estimate.age,
        confidence=estimate.confidence,
    )


def robot_pose_to_message(world: WorldState) -> PoseWithCovarianceStamped:
    """Return the robot's pose for standard viewers."""
    message = PoseWithCovarianceStamped(header=header(world.stamp, MAP))
    message.pose.pose.position.x = world.robot.pose.x
    message.pose.pose.position.y = world.robot.pose.y
    message.pose.pose.orientation = quaternion(world.robot.pose.yaw)
    covariance = np.zeros((6, 6))
    covariance[PLANE] = world.robot.covariance
    message.pose.covariance = covariance.ravel()
    return message


def map_to_odom_message(world: WorldState) -> TFMessage:
    """Return where odom lies in map, for /tf."""
    odom = world.robot.pose @ world.robot.pose_in_odom.inverse()
    message = TransformStamped(header=header(world.stamp, MAP), child_frame_id=ODOM)
    message.transform.translation.x = odom.x
    message.transform.translation.y = odom.y
    message.transform.rotation = quaternion(odom.yaw)
    return TFMessage(transforms=[message])


def start_pose_to_message(pose: Pose2D, stamp: int) -> PoseWithCovarianceStamped:
    """Return where the robot was set down, base_footprint in map, at a stamp [ns]."""
    message = PoseWithCovarianceStamped(header=header(stamp, MAP))
    message.pose.pose.position.x, message.pose.pose.position.y = pose.x, pose.y
    message.pose.pose.orientation = quaternion(pose.yaw)
    return message


def start_pose_from_message(message: PoseWithCovarianceStamped) -> Pose2D | None:
    """Return where the robot was set down, or None if the message holds no pose on the ground."""
    place, turn = message.pose.pose.position, message.pose.pose.orientation
    values = (place.x, place.y, turn.x, turn.y, turn.z, turn.w)
    if not (math.hypot(*values[:2]) <= FARTHEST and 0.5 <= math.hypot(*values[2:]) <= 2.0):  # also catches NaN
        return None
    return pose_on_ground(values[:2], values[2:])


def quaternion(yaw: float) -> Quaternion:
    """Return a rotation about z [rad] as a message."""
    return Quaternion(z=math.sin(yaw / 2.0), w=math.cos(yaw / 2.0))
