"""Kick: line up so that the ball lies before one foot, stand, check, kick, wait for the end."""

from __future__ import annotations

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Sequence
from py_trees.decorators import FailureIsRunning

from tulip_motion.interface import KickGoal, MotionMode, Side
from tulip_strategy.behaviour.base import Leaf
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.gaze import look_at_ball, track_ball
from tulip_strategy.behaviour.keep_off import in_kicks_way
from tulip_strategy.behaviour.steering import from_aim_frame, in_aim_frame, limited


class KickChance(Leaf):
    """Succeeds while the ball is near enough to the goal and a gap beside the keeper is wide enough."""

    def __init__(self, context: Context) -> None:
        super().__init__("kick chance", context)
        self._holds = False

    def update(self) -> Status:
        """Test, with wider limits once it holds."""
        parameters, aim = self.context.parameters, self.context.aim
        reach = parameters.kick_range_end if self._holds else parameters.kick_range
        gap = parameters.kick_gap_end if self._holds else parameters.kick_gap
        wide_enough = aim.gap >= gap or aim.distance < parameters.kick_always_range
        self._holds = aim.distance <= reach and wide_enough
        return Status.SUCCESS if self._holds else Status.FAILURE


class Foot:
    """The foot that kicks, chosen when the alignment begins."""

    def __init__(self) -> None:
        self.side = Side.RIGHT

    def lateral(self, context: Context) -> float:
        """Where the ball shall lie, positive to the left [m]."""
        return context.parameters.kick_lateral * (1.0 if self.side is Side.LEFT else -1.0)


def heading_window(context: Context) -> float:
    """Return how far the robot may face beside the aim [rad]."""
    parameters = context.parameters
    return max(parameters.kick_heading_window, parameters.kick_gap_share * context.aim.gap)


def in_kick_window(context: Context, lateral: float, growth: float) -> bool:
    """Tell whether the ball lies before the foot, within the windows times `growth`."""
    parameters, ball = context.parameters, context.ball.position
    if ball is None:
        return False
    return (
        abs(ball[0] - parameters.kick_ahead) <= growth * parameters.kick_ahead_window
        and abs(ball[1] - lateral) <= growth * parameters.kick_lateral_window
        and abs(context.aim.direction) <= growth * heading_window(context)
    )


class Align(Leaf):
    """Steps to where the ball lies before the foot that has the shorter way."""

    def __init__(self, context: Context, foot: Foot) -> None:
        super().__init__("line up", context)
        self._foot = foot
        self._begun = 0

    def initialise(self) -> None:
        """Choose the foot."""
        self._begun = self.context.stamp
        if self.context.ball.position is not None:
            _, left = in_aim_frame(self.context.ball.position, self.context.aim.direction)
            self._foot.side = Side.LEFT if left >= 0.0 else Side.RIGHT

    def update(self) -> Status:
        """Step on until the ball lies in the window."""
        context, parameters = self.context, self.context.parameters
        if context.ball.position is None:
            return Status.FAILURE
        lateral = self._foot.lateral(context)
        patience = parameters.kick_patience
        growth = min(parameters.kick_window_growth, 1.0 + context.seconds_since(self._begun) / patience)
        if in_kick_window(context, lateral, growth):
            look_at_ball(context)
            return Status.SUCCESS
        aim = context.aim.direction
        ahead, left = in_aim_frame(context.ball.position, aim)
        offset = left - lateral
        lined_up = abs(offset) <= 2.0 * parameters.kick_lateral_window and abs(aim) <= 2.0 * heading_window(context)
        forward = self._forward(ahead, lined_up)
        x, y = from_aim_frame(forward, parameters.near_gain * offset, aim)
        context.walk(limited((x, y, parameters.heading_gain * aim), parameters))
        if ahead < parameters.kick_wait_ahead:
            look_at_ball(context)  # the last steps need the ball in view
        else:
            track_ball(context)
        return Status.RUNNING

    def _forward(self, ahead: float, lined_up: bool) -> float:
        """Return the speed towards the ball [m/s]: it has to be low before the toe can touch the ball."""
        parameters = self.context.parameters
        to_wait = ahead - parameters.kick_wait_ahead
        if to_wait > 0.0:
            return parameters.kick_approach_gain * to_wait + (parameters.kick_align_speed if lined_up else 0.0)
        forward = parameters.near_gain * (ahead - parameters.kick_ahead if lined_up else to_wait)
        return max(-parameters.kick_align_speed, min(parameters.kick_align_speed, forward))


class Settle(Leaf):
    """Stands until motion control does too; succeeds where the ball still lies before the foot."""

    def __init__(self, context: Context, foot: Foot) -> None:
        super().__init__("settle", context)
        self._foot = foot
        self._begun = 0

    def initialise(self) -> None:
        """Note the time."""
        self._begun = self.context.stamp

    def update(self) -> Status:
        """Wait, then check."""
        context, parameters = self.context, self.context.parameters
        context.stand()
        look_at_ball(context)
        waited = context.seconds_since(self._begun)
        standing = context.motion is not None and context.motion.mode is MotionMode.STAND
        if waited < parameters.kick_settle_time or not (standing or waited >= parameters.kick_settle_limit):
            return Status.RUNNING
        good = in_kick_window(context, self._foot.lateral(context), parameters.kick_settle_growth)
        return Status.SUCCESS if good else Status.FAILURE


class Strike(Leaf):
    """Asks for the kick, once."""

    def __init__(self, context: Context, foot: Foot) -> None:
        super().__init__("kick", context)
        self._foot = foot

    def update(self) -> Status:
        """Ask, unless somebody stands in the way of the leg."""
        context, parameters = self.context, self.context.parameters
        ball, limit = context.ball.position, parameters.kick_direction_limit
        outward = 1.0 if self._foot.side is Side.LEFT else -1.0
        room = limit
        if ball is not None:
            # The nearer the ball lies to the other foot, the less the run-up may come from there.
            room += parameters.kick_outward_slope * (outward * ball[1] - parameters.kick_lateral)
        direction = outward * max(-limit, min(limit, room, outward * context.aim.direction))
        if in_kicks_way(direction, context.bodies, parameters):
            return Status.FAILURE
        ask_for_kick(context, KickGoal(self._foot.side, direction, context.aim.speed, ball=ball))
        return Status.SUCCESS


def ask_for_kick(context: Context, goal: KickGoal) -> None:
    """Put a kick into the wish and remember that it was asked for."""
    context.stand()
    look_at_ball(context)
    context.kick = goal
    context.kick_sent = context.stamp
    context.kick_seen = False


class KickUnderWay(Leaf):
    """Runs from asking for a kick until motion control has ended it, or has not begun it in time."""

    def __init__(self, context: Context) -> None:
        super().__init__("kick under way", context)

    def update(self) -> Status:
        """Stand and watch the ball until the kick has ended."""
        context, parameters = self.context, self.context.parameters
        kicking = context.motion is not None and context.motion.mode is MotionMode.KICK
        if kicking and context.kick_sent is None:
            context.kick_sent = context.stamp  # someone else asked for it
        if context.kick_sent is None:
            return Status.FAILURE
        context.kick_seen = context.kick_seen or kicking
        waited = context.seconds_since(context.kick_sent)
        ended = context.kick_seen and not kicking
        limit = parameters.kick_run_limit if context.kick_seen else parameters.kick_start_limit
        if ended or waited > limit:
            context.kick_sent = None
            context.kicks += context.kick_seen
            return Status.FAILURE
        context.stand()
        look_at_ball(context)
        return Status.RUNNING


def line_up_and_kick(context: Context) -> Behaviour:
    """Return the subtree that lines up and kicks along the aim."""
    foot = Foot()
    kick = Sequence("line up and kick", memory=True)
    kick.add_children([Align(context, foot), Settle(context, foot), Strike(context, foot)])
    # Not standing right after all means to line up again, not to dribble.
    return FailureIsRunning("until it succeeds", kick)


def kick_at_goal(context: Context) -> Sequence:
    """Return the subtree that kicks where there is a chance."""
    sequence = Sequence("kick at goal", memory=False)
    sequence.add_children([KickChance(context), line_up_and_kick(context)])
    return sequence
