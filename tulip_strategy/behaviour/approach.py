"""Come round behind the ball without touching it."""

from __future__ import annotations

import math

from py_trees.common import Status

from tulip_strategy.behaviour.base import Leaf
from tulip_strategy.behaviour.context import Context, Point
from tulip_strategy.behaviour.gaze import track_ball
from tulip_strategy.behaviour.path import arc_round, distance_to_way, next_waypoint, side_round
from tulip_strategy.behaviour.steering import from_aim_frame, in_aim_frame, towards


class BehindBall(Leaf):
    """Succeeds while the robot stands behind the ball, on the line from the ball to the aim and facing it."""

    def __init__(self, context: Context) -> None:
        super().__init__("behind the ball", context)
        self._holds = False

    def update(self) -> Status:
        """Test, with wider limits once it holds."""
        self._holds = self._behind()
        return Status.SUCCESS if self._holds else Status.FAILURE

    def _behind(self) -> bool:
        parameters, ball = self.context.parameters, self.context.ball
        if not ball.known or ball.position is None:
            return False
        aim = self.context.aim.direction
        ahead, left = in_aim_frame(ball.position, aim)
        if self._holds:
            reach, heading = parameters.behind_reach_end, parameters.behind_heading_end
            offset = parameters.behind_offset_end + parameters.behind_cone_end * max(0.0, ahead)
        else:
            reach, heading = parameters.behind_reach, parameters.behind_heading
            offset = parameters.behind_offset + parameters.behind_cone * max(0.0, ahead)
        return parameters.behind_nearest < ahead < reach and abs(left) < offset and abs(aim) < heading


class Approach(Leaf):
    """Walks to a place behind the ball, round the ball with a clearance."""

    def __init__(self, context: Context) -> None:
        super().__init__("come round behind the ball", context)
        self._side = 0

    def initialise(self) -> None:
        """Choose the side anew."""
        self._side = 0

    def update(self) -> Status:
        """Walk on."""
        context, parameters = self.context, self.context.parameters
        ball = context.ball.position
        if ball is None:
            return Status.FAILURE
        aim = context.aim.direction
        back = from_aim_frame(-parameters.standoff, 0.0, aim)
        target = (ball[0] + back[0], ball[1] + back[1])
        self._side = side_round(target, ball, self._side)
        side = self._free_side(target, ball)
        waypoint = next_waypoint(target, ball, parameters.ball_clearance, side, parameters.arc_ahead)
        way_left = math.hypot(*waypoint) + math.dist(waypoint, target)
        waypoint = self._round_obstacles(waypoint)
        context.walk(towards(waypoint, way_left, aim, way_left > parameters.face_travel_distance, parameters))
        track_ball(context)
        return Status.RUNNING

    def _free_side(self, target: Point, ball: Point) -> int:
        """Return the side of the shorter way round the ball, or the other one if something stands in only that way."""
        clearance = self.context.parameters.ball_clearance
        obstacles = self.context.obstacles

        def is_free(side: int) -> bool:
            places = arc_round(target, ball, clearance, side)
            return all(math.dist(each.position, place) > each.keep_off for each in obstacles for place in places)

        return self._side if is_free(self._side) or not is_free(-self._side) else -self._side

    def _round_obstacles(self, waypoint: Point) -> Point:
        """Return a waypoint beside the nearest obstacle that stands in the way, else the waypoint itself."""
        for obstacle in sorted(self.context.obstacles, key=lambda each: math.hypot(*each.position)):
            place, clearance = obstacle.position, obstacle.clearance
            at_target = math.dist(place, waypoint) < clearance
            if not at_target and distance_to_way(place, (0.0, 0.0), waypoint) < clearance:
                side = side_round(waypoint, place, 0)
                return next_waypoint(waypoint, place, clearance, side, self.context.parameters.arc_ahead)
        return waypoint
