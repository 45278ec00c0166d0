"""Dribble: walk into the ball towards the goal and steer behind it."""

from __future__ import annotations

from py_trees.common import Status

from tulip_strategy.behaviour.base import Leaf
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.gaze import track_ball
from tulip_strategy.behaviour.steering import from_aim_frame, in_aim_frame, limited


class Dribble(Leaf):
    """Pushes the ball along the aim; lines up first where it would be hit off-centre and stray sideways."""

    def __init__(self, context: Context) -> None:
        super().__init__("dribble", context)

    def update(self) -> Status:
        """Walk on."""
        context, parameters = self.context, self.context.parameters
        if context.ball.position is None:
            return Status.FAILURE
        aim = context.aim.direction
        ahead, left = in_aim_frame(context.ball.position, aim)
        offset = left - parameters.dribble_lateral
        in_reach = ahead < parameters.dribble_contact
        lined_up = abs(offset) < parameters.dribble_offset and abs(aim) < parameters.dribble_heading
        if not in_reach:
            # No faster than the distance lets it line up before the contact.
            forward = min(
                parameters.dribble_chase_speed,
                parameters.dribble_speed + parameters.position_gain * (ahead - parameters.dribble_contact),
            )
        elif lined_up:
            forward = parameters.dribble_speed
        else:
            forward = parameters.position_gain * (ahead - parameters.dribble_contact)
        x, y = from_aim_frame(forward, parameters.near_gain * offset, aim)
        context.walk(limited((x, y, parameters.heading_gain * aim), parameters))
        track_ball(context)
        return Status.RUNNING
