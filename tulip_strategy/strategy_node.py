"""Node "strategy": world, game, user and motion in; walk command, head command and kicks out."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from rclpy.action import ActionClient

from tulip_description.emergency_stop import StopWord
from tulip_description.field import FieldError, load_field
from tulip_motion.interface import KickGoal
from tulip_motion.messages import head_command_to_message, motion_state_from_message, walk_command_to_message
from tulip_msgs.msg import GameState as GameStateMessage
from tulip_msgs.msg import MotionState as MotionStateMessage
from tulip_msgs.msg import UserCommand as UserCommandMessage
from tulip_msgs.msg import WorldState as WorldStateMessage
from tulip_ros import topics
from tulip_ros.emergency_stop import StopLink
from tulip_ros.errors import BadInputError
from tulip_ros.run import ComponentNode, run
from tulip_strategy.interface import GameState, UserCommand, UserRequest
from tulip_strategy.messages import (
    decision_to_message,
    game_state_from_message,
    kick_goal_to_message,
    tree_to_message,
    user_command_from_message,
    world_state_from_message,
)
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_strategy.tree_state import NodeStatus


@dataclass(frozen=True)
class StrategyNodeParameters(StrategyParameters):
    """Parameters of strategy and of its node."""

    field_file: str = ""  # "" for the AdultSize field of 2013
    field_turned: bool = False  # the team attacks the goal at -x of the file, so its map is turned by half a circle


class StrategyNode(ComponentNode):
    """Decides on each world state."""

    def __init__(self) -> None:
        """Make the core and connect it."""
        super().__init__("strategy")
        self._settings = self.load(StrategyNodeParameters())
        try:
            field = load_field(self._settings.field_file or None)
        except FieldError as error:
            raise BadInputError(f"Parameter field_file of node 'strategy': {error}") from error
        self._field = field.turned() if self._settings.field_turned else field
        self._user = UserCommand(0, UserRequest.STOP)
        self.begin_anew()
        self._walk = self.sender(topics.WALK_COMMAND)
        self._head = self.sender(topics.HEAD_COMMAND)
        self._decision = self.sender(topics.DECISION)
        self._tree = self.sender(topics.BEHAVIOUR_TREE)
        self._kicks = ActionClient(self, topics.KICK.type, topics.KICK.name)
        self._emergency_stop = StopLink(self, "strategy", self._on_emergency_stop)
        self.listen(topics.WORLD_STATE, self._on_world_state)
        self.listen(topics.GAME_STATE, self._on_game_state)
        self.listen(topics.USER_COMMAND, self._on_user_command)
        self.listen(topics.MOTION_STATE, self._on_motion_state)

    def begin_anew(self) -> None:
        """Make the core and wait for the game; the user's wish holds until user input sends the next."""
        self._strategy = Strategy(self._settings, self._field)
        self._game: GameState | None = None
        self._motion: MotionStateMessage | None = None
        self._told: tuple[NodeStatus, ...] = ()

    def _on_game_state(self, message: GameStateMessage) -> None:
        self._game = game_state_from_message(message)

    def _on_user_command(self, message: UserCommandMessage) -> None:
        self._user = user_command_from_message(message)

    def _on_emergency_stop(self, word: StopWord) -> None:
        """Forget what the user wanted before: after its release the robot stays limp until the next wish."""
        if word.engaged:
            self._user = replace(self._user, request=UserRequest.LIMP)

    def _on_motion_state(self, message: MotionStateMessage) -> None:
        self._motion = message  # at 250 Hz; read when a decision needs it

    def _on_world_state(self, message: WorldStateMessage) -> None:
        world = world_state_from_message(message)
        motion = None if self._motion is None else motion_state_from_message(self._motion)
        user = replace(self._user, request=UserRequest.LIMP) if self._emergency_stop.engaged else self._user
        decision = self._strategy.decide(world.stamp, world, self._game, user, motion)
        self._walk.publish(walk_command_to_message(decision.walk))
        self._head.publish(head_command_to_message(decision.head))
        self._decision.publish(decision_to_message(decision))
        tree = self._strategy.tree
        if tree.statuses != self._told:
            self._tree.publish(tree_to_message(tree))
            self._told = tree.statuses
        if decision.kick is not None:
            self._kick(decision.kick)

    def _kick(self, goal: KickGoal) -> None:
        """Send the goal; the kick's progress comes back in motion_state, a refusal in diagnostics."""
        if not self._kicks.server_is_ready():
            self.health.count("kicks without motion control", "no node serves the Kick action; is motion running?")
            return
        self._kicks.send_goal_async(kick_goal_to_message(goal)).add_done_callback(self._on_kick_answer)

    def _on_kick_answer(self, future: Any) -> None:
        answer = future.result()
        if not answer.accepted:
            self.health.count("refused kicks", "motion control refused a kick; motion_state tells its mode")
            return
        self.health.count("kicks")
        answer.get_result_async().add_done_callback(self._on_kick_end)

    def _on_kick_end(self, future: Any) -> None:
        result = future.result().result
        if not result.success:
            self.health.count("failed kicks", f"kick failed: {result.reason}")


def main() -> None:
    """Run the node."""
    run(StrategyNode)


if __name__ == "__main__":
    main()
