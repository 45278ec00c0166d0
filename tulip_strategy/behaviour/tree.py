"""The whole tree: the user first, then the robot's own state, then the referee, then the game."""

from __future__ import annotations

from collections.abc import Callable

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.composites import Selector
from py_trees.decorators import EternalGuard

from tulip_description.planar import Pose2D
from tulip_motion.interface import KickGoal, MotionMode, Side, WalkMode
from tulip_strategy.behaviour.base import Act, Leaf
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.dribble_and_kick import dribble_and_kick
from tulip_strategy.behaviour.dribble_course import dribble_course
from tulip_strategy.behaviour.gaze import look_ahead, look_for_ball, track_ball
from tulip_strategy.behaviour.goalkeeper import goalkeeper
from tulip_strategy.behaviour.kick import KickUnderWay, ask_for_kick
from tulip_strategy.behaviour.place import go_to
from tulip_strategy.behaviour.steering import limited
from tulip_strategy.behaviour.throw_in import throw_in
from tulip_strategy.interface import GamePhase, UserRequest

STRATEGIES: dict[str, Callable[[Context], Behaviour]] = {
    "dribble_and_kick": dribble_and_kick,
    "goalkeeper": goalkeeper,
    "throw_in": throw_in,
    "dribble_course": dribble_course,
}
"""Strategies that a user can choose for PLAY, by name."""


def build_tree(context: Context) -> Behaviour:
    """Return the root of the tree, which writes its wish into the context at every tick."""
    root = Selector("robot", memory=False)
    root.add_children(
        [
            _when("limp", context, _wants(UserRequest.LIMP), Act("stay limp", context, _limp)),
            _when("user stops", context, _wants(UserRequest.STOP, UserRequest.STAND), Act("stand", context, _rest)),
            _when("fallen", context, _is_fallen, Act("stay down", context, _stay_down)),
            KickUnderWay(context),
            _when("walk test", context, _wants(UserRequest.WALK_TEST), Act("walk", context, _walk_test)),
            _when("kick test", context, _wants(UserRequest.KICK_TEST), KickTest(context)),
            _when("no world state", context, lambda c: c.world is None, Act("stand", context, _rest)),
            _when("no referee yet", context, lambda c: c.game is None, Act("stand", context, _rest)),
            _when("penalised", context, lambda c: c.game is not None and c.game.penalty != 0, _still("stand", context)),
            _when("halted", context, lambda c: c.game is not None and c.game.halted, _still("stand still", context)),
            _when("initial", context, _in_phase(GamePhase.INITIAL), Act("stand", context, _rest)),
            _when("blind", context, _is_blind, Act("stand", context, _rest)),
            _when("ready", context, _in_phase(GamePhase.READY), Act("go to place", context, _go_to_place)),
            _when("set", context, _in_phase(GamePhase.SET), _still("stand still", context)),
            _when("finished", context, _in_phase(GamePhase.FINISHED), Act("stand", context, _rest)),
            _playing(context),
        ]
    )
    return root


class KickTest(Leaf):
    """Kicks once a command."""

    def __init__(self, context: Context) -> None:
        super().__init__("kick once", context)
        self._done: int | None = None

    def update(self) -> Status:
        """Kick where the command is new."""
        context = self.context
        context.stand()
        look_ahead(context)
        if self._done != context.user.sequence:
            self._done = context.user.sequence
            side = Side.LEFT if context.user.argument == "left" else Side.RIGHT
            ask_for_kick(context, KickGoal(side, 0.0, context.parameters.kick_speed))
        return Status.RUNNING


def _playing(context: Context) -> Behaviour:
    playing = Selector("playing", memory=False)
    for name, build in STRATEGIES.items():
        playing.add_child(_when(f"plays {name}", context, _chose(name), build(context)))
    playing.add_child(Act("unknown strategy", context, _rest))
    return playing


def _when(name: str, context: Context, test: Callable[[Context], bool], then: Behaviour) -> Behaviour:
    guard = EternalGuard(name, then, lambda: test(context))
    # py_trees would keep each guard's in a list for ever, and every robot that is set up anew builds the tree again.
    guard.blackboard.unregister()
    return guard


def _still(name: str, context: Context) -> Act:
    return Act(name, context, _stand_and_watch)


def _wants(*requests: UserRequest) -> Callable[[Context], bool]:
    return lambda context: context.user.request in requests


def _chose(strategy: str) -> Callable[[Context], bool]:
    return lambda context: context.user.strategy == strategy


def _in_phase(phase: GamePhase) -> Callable[[Context], bool]:
    return lambda context: context.game is not None and context.game.phase is phase


def _is_fallen(context: Context) -> bool:
    return context.motion is not None and context.motion.mode is MotionMode.FALLEN


def _is_blind(context: Context) -> bool:
    """Return whether pictures have stopped coming: a robot that walks without seeing may walk into anything."""
    world = context.world
    if world is None or not world.picture:
        return False
    return (world.stamp - world.picture) * 1e-9 > context.parameters.blind_age


def _limp(context: Context) -> None:
    context.mode = WalkMode.LIMP


def _stay_down(context: Context) -> None:
    """Lie limp; a robot that was taken out of play stands up as soon as people have set it upright."""
    taken_out = context.game is not None and context.game.penalty != 0
    context.mode = WalkMode.STAND if taken_out else WalkMode.LIMP


def _rest(context: Context) -> None:
    context.stand()
    look_ahead(context)


def _stand_and_watch(context: Context) -> None:
    context.stand()
    track_ball(context)


def _go_to_place(context: Context) -> None:
    parameters = context.parameters
    if context.world is None or not parameters.walk_to_ready:
        _stand_and_watch(context)
        return
    look_for_ball(context)
    go_to(context, Pose2D(parameters.ready_x, parameters.ready_y, parameters.ready_yaw), parameters.place_tolerance)


def _walk_test(context: Context) -> None:
    context.walk(limited(context.user.velocity, context.parameters))
    look_ahead(context)
