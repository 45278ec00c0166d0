"""Strategy and head movement, computed anew from recorded inputs."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tulip_description.emergency_stop import EmergencyStop
from tulip_description.field import Field
from tulip_description.robot import HEAD_JOINTS, load_robot
from tulip_motion.head import HeadMovement, HeadParameters
from tulip_motion.interface import HeadCommand, HeadMode
from tulip_motion.messages import (
    head_command_from_message,
    head_command_to_message,
    joint_command_to_message,
    motion_state_from_message,
    walk_command_to_message,
)
from tulip_ros import topics
from tulip_ros.emergency_stop import word_from_message
from tulip_sim.recompute.heard import OVERDUE, UNIX_TIME, Heard, Made
from tulip_strategy.interface import GameState, UserCommand, UserRequest
from tulip_strategy.messages import (
    decision_to_message,
    game_state_from_message,
    tree_to_message,
    user_command_from_message,
    world_state_from_message,
)
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_strategy.tree_state import NodeStatus

KEPT = 100
"""Messages of a topic among which the one that an output was computed on is looked for: 0.4 s of the fastest."""


class StrategyStage:
    """Node strategy: a decision's stamp tells on which world state and legs' state it was made."""

    reads = frozenset(
        topic.name
        for topic in (
            topics.WORLD_STATE,
            topics.GAME_STATE,
            topics.USER_COMMAND,
            topics.EMERGENCY_STOP,
            topics.MOTION_STATE,
        )
    )
    writes = frozenset(
        topic.name for topic in (topics.DECISION, topics.WALK_COMMAND, topics.HEAD_COMMAND, topics.BEHAVIOUR_TREE)
    )
    told_by = frozenset((topics.DECISION.name,))

    def __init__(self, parameters: StrategyParameters, field: Field, stale_after: float) -> None:
        """Make the core.

        Args:
            parameters: Of the core.
            field: As the robot's team sees it.
            stale_after: Age from which a lockstep's game input calls the referee silent [s].
        """
        self._strategy = Strategy(parameters, field)
        self._stale_after = round(stale_after * 1e9)
        self._worlds: deque[Heard | Made] = deque()
        self._motions: deque[Heard] = deque(maxlen=KEPT)
        self._asked: deque[Heard] = deque()
        self._wishes: deque[Heard] = deque()  # of referee and user, not taken yet, and words of the emergency stop
        self._stop = EmergencyStop()
        self._game: GameState | None = None
        self._user = UserCommand(0, UserRequest.STOP)
        self._told: tuple[NodeStatus, ...] = ()
        self._counts: Counter[str] = Counter()

    def hear(self, heard: Heard | Made) -> Iterator[Made]:
        """Hold an input."""
        if heard.name == topics.WORLD_STATE.name:
            self._worlds.append(heard)
        elif isinstance(heard, Heard):
            (self._motions if heard.name == topics.MOTION_STATE.name else self._wishes).append(heard)
        yield from self._decide(heard.log_time)

    def answer(self, recorded: Heard) -> Iterator[Made]:
        """Decide anew where the run decided."""
        self._asked.append(recorded)
        yield from self._decide(recorded.log_time)

    def finish(self) -> Iterator[Made]:
        """Decide what was waited for."""
        yield from self._decide(None)

    def shortcomings(self) -> dict[str, int]:
        """Return what could not be computed, by reason."""
        return dict(self._counts)

    def _decide(self, now: int | None) -> Iterator[Made]:
        while self._asked:
            asked = self._asked[0]
            # A decision that overtook its world state on the way to the recorder waits for it, and its legs' state.
            if not (self._worlds and self._worlds[-1].stamp >= asked.stamp) and (
                now is not None and now - asked.log_time < OVERDUE
            ):
                return
            self._asked.popleft()
            while self._worlds and self._worlds[0].stamp < asked.stamp:
                self._worlds.popleft()
            if not self._worlds or self._worlds[0].stamp != asked.stamp:
                self._counts["decisions whose world state is not recorded"] += 1
                continue
            yield from self._decide_on(self._worlds.popleft(), asked)

    def _decide_on(self, heard: Heard | Made, asked: Heard) -> Iterator[Made]:
        while self._wishes and self._wishes[0].log_time <= asked.log_time:
            wish = self._wishes.popleft()
            if wish.name == topics.GAME_STATE.name:
                self._game = game_state_from_message(wish.message)
            elif wish.name == topics.EMERGENCY_STOP.name:
                self._stop.hear(word_from_message(wish.message), wish.log_time)
                if self._stop.engaged:
                    self._user = replace(self._user, request=UserRequest.LIMP)
            else:
                self._user = user_command_from_message(wish.message)
        stamp, game = asked.stamp, self._game
        if game is not None and asked.log_time < UNIX_TIME and stamp - game.stamp > self._stale_after:
            game = replace(game, stale=True)  # the node tells so itself
        motion = next((each for each in reversed(self._motions) if each.stamp <= stamp), None)
        state = None if motion is None else motion_state_from_message(motion.message)
        world = world_state_from_message(heard.message)
        user = replace(self._user, request=UserRequest.LIMP) if self._stop.engaged else self._user
        decision = self._strategy.decide(stamp, world, game, user, state)
        for name, message in (
            (topics.WALK_COMMAND.name, walk_command_to_message(decision.walk)),
            (topics.HEAD_COMMAND.name, head_command_to_message(decision.head)),
            (topics.DECISION.name, decision_to_message(decision)),
        ):
            yield Made(name, asked.log_time, stamp, message)
        tree = self._strategy.tree
        if tree.statuses != self._told:
            self._told = tree.statuses
            yield Made(topics.BEHAVIOUR_TREE.name, asked.log_time, stamp, tree_to_message(tree))


class HeadStage:
    """Node head: a command's stamp tells which joint state it answers."""

    reads = frozenset((topics.HEAD_COMMAND.name, topics.JOINT_STATES.name, topics.EMERGENCY_STOP.name))
    writes = frozenset((topics.HEAD_JOINT_COMMAND.name,))
    told_by = writes

    def __init__(self, parameters: HeadParameters) -> None:
        """Make the core."""
        self._head = HeadMovement(parameters, load_robot())
        self._command = HeadCommand(0, HeadMode.HOLD)
        self._joints: deque[Heard] = deque(maxlen=KEPT)
        self._stop = EmergencyStop()
        self._counts: Counter[str] = Counter()

    def hear(self, heard: Heard | Made) -> Iterator[Made]:
        """Take a command; keep a joint state."""
        if heard.name == topics.HEAD_COMMAND.name:
            self._command = head_command_from_message(heard.message)
        elif heard.name == topics.EMERGENCY_STOP.name and isinstance(heard, Heard):
            self._stop.hear(word_from_message(heard.message), heard.log_time)
        elif isinstance(heard, Heard):
            self._joints.append(heard)
        yield from ()

    def answer(self, recorded: Heard) -> Iterator[Made]:
        """Compute the command that answers the same joint state."""
        stamp = recorded.stamp
        joints = next((each for each in reversed(self._joints) if each.stamp == stamp), None)
        if joints is None:
            self._counts["head commands whose joint state is not recorded"] += 1
            return
        measured = dict(zip(joints.message.name, joints.message.position, strict=True))
        angles = np.array([measured[name] for name in HEAD_JOINTS])
        if self._stop.engaged:
            command = self._head.limp(stamp, angles)
        else:
            command = self._head.update(stamp, self._command, angles)
        yield Made(topics.HEAD_JOINT_COMMAND.name, recorded.log_time, stamp, joint_command_to_message(command))

    def finish(self) -> Iterator[Made]:
        """Nothing is waited for."""
        yield from ()

    def shortcomings(self) -> dict[str, int]:
        """Return what could not be computed, by reason."""
        return dict(self._counts)
