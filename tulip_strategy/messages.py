"""Domain objects of strategy to messages and back."""

from __future__ import annotations

from typing import Any

import numpy as np

from tulip_description.frames import BASE_FOOTPRINT
from tulip_description.planar import Pose2D
from tulip_motion.interface import KickGoal
from tulip_motion.messages import head_command_to_message, walk_command_to_message
from tulip_msgs.action import Kick
from tulip_msgs.msg import BehaviourTree as BehaviourTreeMessage
from tulip_msgs.msg import Decision as DecisionMessage
from tulip_msgs.msg import GameState as GameStateMessage
from tulip_msgs.msg import MotionState as MotionStateMessage
from tulip_msgs.msg import ObjectEstimate as ObjectEstimateMessage
from tulip_msgs.msg import UserCommand as UserCommandMessage
from tulip_msgs.msg import WorldState as WorldStateMessage
from tulip_ros.time import from_message, header, stamp_of
from tulip_strategy.game_controller import RobotStatus
from tulip_strategy.interface import (
    Decision,
    GamePhase,
    GameState,
    Penalty,
    SecondaryState,
    SetPlay,
    UserCommand,
    UserRequest,
)
from tulip_strategy.tree_state import NodeKind, NodeStatus, TreeState
from tulip_worldmodel.world_state import ObjectEstimate, RobotEstimate, WorldState


def game_state_to_message(state: GameState) -> GameStateMessage:
    """Return a game state as a message."""
    return GameStateMessage(
        header=header(state.stamp),
        version=state.version,
        phase=state.phase.value,
        first_half=state.first_half,
        kick_off=state.kick_off,
        secondary_state=state.secondary_state.value,
        seconds_remaining=state.seconds_remaining,
        own_score=state.own_score,
        opponent_score=state.opponent_score,
        penalty=state.penalty.value,
        seconds_till_unpenalised=state.seconds_till_unpenalised,
        stale=state.stale,
        stopped=state.stopped,
        set_play=state.set_play.value,
        goalkeeper=state.goalkeeper,
    )


def game_state_from_message(message: GameStateMessage) -> GameState:
    """Return the game state of a message."""
    return GameState(
        stamp=stamp_of(message),
        version=message.version,
        phase=GamePhase(message.phase),
        first_half=message.first_half,
        kick_off=message.kick_off,
        secondary_state=SecondaryState(message.secondary_state),
        seconds_remaining=message.seconds_remaining,
        own_score=message.own_score,
        opponent_score=message.opponent_score,
        penalty=Penalty(message.penalty),
        seconds_till_unpenalised=message.seconds_till_unpenalised,
        stale=message.stale,
        stopped=message.stopped,
        set_play=SetPlay(message.set_play),
        goalkeeper=message.goalkeeper,
    )


def tree_to_message(tree: TreeState) -> BehaviourTreeMessage:
    """Return a behaviour tree as a message."""
    return BehaviourTreeMessage(
        header=header(tree.stamp, BASE_FOOTPRINT),
        names=list(tree.names),
        parents=list(tree.parents),
        kinds=[kind.value for kind in tree.kinds],
        statuses=[status.value for status in tree.statuses],
    )


def tree_from_message(message: BehaviourTreeMessage) -> TreeState:
    """Return the behaviour tree of a message."""
    return TreeState(
        stamp=stamp_of(message),
        names=tuple(message.names),
        parents=tuple(message.parents),
        kinds=tuple(NodeKind(kind) for kind in message.kinds),
        statuses=tuple(NodeStatus(status) for status in message.statuses),
    )


def user_command_to_message(command: UserCommand) -> UserCommandMessage:
    """Return a user command as a message."""
    return UserCommandMessage(
        header=header(command.stamp),
        request=command.request.value,
        strategy=command.strategy,
        velocity=list(command.velocity),
        argument=command.argument,
        sequence=command.sequence,
    )


def user_command_from_message(message: UserCommandMessage) -> UserCommand:
    """Return the user command of a message."""
    return UserCommand(
        stamp=stamp_of(message),
        request=UserRequest(message.request),
        strategy=message.strategy,
        velocity=_three(message.velocity),
        argument=message.argument,
        sequence=message.sequence,
    )


def decision_to_message(decision: Decision) -> DecisionMessage:
    """Return a decision as a message."""
    message = DecisionMessage(
        header=header(decision.stamp, BASE_FOOTPRINT),
        walk=walk_command_to_message(decision.walk),
        head=head_command_to_message(decision.head),
        tree=decision.tree,
    )
    if decision.kick is not None:
        message.kick_requested = True
        message.kick_side = decision.kick.side.value
        message.kick_kind = decision.kick.kind.value
        message.kick_direction = decision.kick.direction
        message.kick_speed = decision.kick.speed
    return message


def kick_goal_to_message(goal: KickGoal) -> Any:
    """Return a kick as the goal of the action."""
    return Kick.Goal(
        side=goal.side.value,
        kind=goal.kind.value,
        direction=goal.direction,
        speed=goal.speed,
        has_ball=goal.ball is not None,
        ball=list(goal.ball or (0.0, 0.0)),
    )


def world_state_from_message(message: WorldStateMessage) -> WorldState:
    """Return the world state of a message."""
    robot = RobotEstimate(
        pose=Pose2D(*_three(message.robot_pose)),
        covariance=np.array(message.robot_covariance).reshape(3, 3),
        pose_in_odom=Pose2D(*_three(message.robot_pose_in_odom)),
    )
    ball = _object(message.ball) if message.ball_known else None
    opponents = tuple(_object(opponent) for opponent in message.opponents)
    return WorldState(stamp_of(message), robot, ball, opponents, from_message(message.picture))


def robot_status_from_messages(motion: MotionStateMessage, world: WorldStateMessage) -> RobotStatus:
    """Return what the robot tells the referee of itself."""
    ball = (float(world.ball.position[0]), float(world.ball.position[1])) if world.ball_known else None
    return RobotStatus(
        fallen=motion.mode == MotionStateMessage.FALLEN,
        pose=Pose2D(*_three(world.robot_pose)),
        ball=ball,
        ball_age=world.ball.age if world.ball_known else 0.0,
    )


def _object(message: ObjectEstimateMessage) -> ObjectEstimate:
    return ObjectEstimate(
        position=np.array(message.position),
        velocity=np.array(message.velocity),
        covariance=np.array(message.covariance).reshape(4, 4),
        position_in_map=np.array(message.position_in_map),
        velocity_in_map=np.array(message.velocity_in_map),
        age=message.age,
        confidence=message.confidence,
    )


def _three(values: Any) -> tuple[float, float, float]:
    first, second, third = (float(value) for value in values)
    return first, second, third
