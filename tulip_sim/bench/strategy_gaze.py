"""The head as strategy moves it while it follows a ball, without strategy's decisions about the legs."""

from __future__ import annotations

from collections.abc import Callable

from tulip_description.field import Field
from tulip_motion.interface import HeadCommand, HeadMode
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.gaze import track_ball
from tulip_strategy.parameters import StrategyParameters
from tulip_worldmodel.world_state import WorldState

Gaze = Callable[[Context], None]


class StrategyGaze:
    """Shares the gaze between ball and landmarks; searches the ball while it is not known.

    Attributes:
        context: What the behaviours share.
    """

    def __init__(self, parameters: StrategyParameters, field: Field) -> None:
        """Prepare for a field."""
        self.context = Context(parameters, field)

    def command(self, stamp: int, world: WorldState, look: Gaze = track_ball) -> HeadCommand:
        """Return what the head shall do.

        Args:
            stamp: Now [ns].
            world: What the world model says.
            look: Behaviour that chooses.
        """
        context = self.context
        context.clear_wish()
        context.stamp, context.world = stamp, world
        context.ball.update(world)
        look(context)
        glance = context.glance if context.head is HeadMode.TRACK else None
        return HeadCommand(stamp, context.head, context.target, glance)
