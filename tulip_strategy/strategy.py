"""Strategy: combines all inputs and decides what legs and head shall do."""

from __future__ import annotations

import math

from py_trees.behaviour import Behaviour

from tulip_description.field import Field
from tulip_motion.interface import HeadCommand, HeadMode, MotionState, WalkCommand, WalkMode
from tulip_strategy.behaviour.context import Context
from tulip_strategy.behaviour.keep_off import kept_off
from tulip_strategy.behaviour.steering import STILL, Acceleration
from tulip_strategy.behaviour.tree import build_tree
from tulip_strategy.interface import Decision, GamePhase, GameState, UserCommand
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.tree_state import TreeWatch
from tulip_worldmodel.world_state import WorldState

LONGEST_GAP = 0.2  # [s] after a longer pause between decisions, velocities still change as slowly as after this


class Strategy:
    """Decides from world, game and user; the same inputs in the same order give the same decisions."""

    def __init__(self, parameters: StrategyParameters, field: Field) -> None:
        self._context = Context(parameters, field)
        self._tree = build_tree(self._context)
        self._watch = TreeWatch(self._tree)
        self.tree = self._watch.state(0)
        """The whole tree as it decided last."""
        self._acceleration = Acceleration(parameters)
        self._last_stamp: int | None = None

    def decide(
        self,
        stamp: int,
        world: WorldState | None,
        game: GameState | None,
        user: UserCommand,
        motion: MotionState | None,
    ) -> Decision:
        """Return what the robot shall do now.

        Args:
            stamp: Of the newest input [ns].
            world: Newest world state, None before the first.
            game: Newest game state, None before the first packet: the robot stands.
            user: The user's last command.
            motion: Newest state of the legs, None before the first.
        """
        context = self._context
        elapsed = 0.0 if self._last_stamp is None else (stamp - self._last_stamp) * 1e-9
        context.dt = min(LONGEST_GAP, max(0.0, elapsed))
        self._last_stamp = stamp
        context.stamp, context.game = stamp, game
        context.user, context.motion = user, motion
        if game is None or game.phase is not GamePhase.PLAYING:
            context.kicks = 0
        context.clear_wish()
        context.see(world)
        self.tree = self._watch.state(stamp, list(self._tree.tick()))
        return Decision(stamp, self._walk(), self._head(), context.kick, active_path(self._tree))

    def _walk(self) -> WalkCommand:
        context = self._context
        if context.mode is not WalkMode.WALK:
            self._acceleration.reset()
            return WalkCommand(context.stamp, context.mode, STILL)
        velocity = self._acceleration.step(context.velocity, math.inf if context.sudden else context.dt)
        velocity = kept_off(velocity, context.obstacles, context.parameters.keep_off_gain)
        return WalkCommand(context.stamp, WalkMode.WALK, velocity)

    def _head(self) -> HeadCommand:
        context = self._context
        glance = context.glance if context.head is HeadMode.TRACK else None
        return HeadCommand(context.stamp, context.head, context.target, glance)


def active_path(root: Behaviour) -> str:
    """Return the names from the root to the behaviour that decided last, joined by " > "."""
    names: list[str] = []
    node: Behaviour | None = root.tip()
    while node is not None:
        names.append(node.name)
        node = node.parent
    return " > ".join(reversed(names))
