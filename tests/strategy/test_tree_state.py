from __future__ import annotations

import numpy as np
import pytest
from kinematic_bench import game_state, motion_state, seen_object
from py_trees.blackboard import Blackboard
from rich.console import Console

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_motion.interface import MotionMode
from tulip_strategy.behaviour.tree import STRATEGIES
from tulip_strategy.interface import GamePhase, UserCommand, UserRequest
from tulip_strategy.messages import tree_from_message, tree_to_message
from tulip_strategy.parameters import StrategyParameters
from tulip_strategy.strategy import Strategy
from tulip_strategy.tree_drawing import mermaid, terminal_tree
from tulip_strategy.tree_state import NodeKind, NodeStatus, TreeState
from tulip_worldmodel.world_state import RobotEstimate, WorldState

FIELD = load_field()


def after(phase: GamePhase) -> tuple[TreeState, str]:
    """Return the tree after one decision with the ball before the robot, and the path of that decision."""
    strategy, pose = Strategy(StrategyParameters(), FIELD), Pose2D()
    world = WorldState(5, RobotEstimate(pose, np.eye(3) * 1e-4, pose), seen_object(pose, (1.5, 0.0), (0.0, 0.0)), ())
    user = UserCommand(0, UserRequest.PLAY)
    decision = strategy.decide(5, world, game_state(5, phase), user, motion_state(5, MotionMode.STAND))
    return strategy.tree, decision.tree


def running_path(state: TreeState) -> str:
    """Return the names of the running nodes from the root down."""
    running = [index for index, status in enumerate(state.statuses) if status is NodeStatus.RUNNING]
    path, node = [], max(running)
    while node >= 0:
        path.append(state.names[node])
        node = state.parents[node]
    return " > ".join(reversed(path))


@pytest.mark.parametrize("phase", list(GamePhase))
def test_running_nodes_are_the_path_that_decided(phase: GamePhase) -> None:
    state, path = after(phase)
    assert state.stamp == 5
    assert running_path(state) == path
    assert state.parents[0] == -1
    assert all(parent < index for index, parent in enumerate(state.parents))


def test_what_was_not_asked_is_idle_even_if_it_was_asked_before() -> None:
    strategy, pose = Strategy(StrategyParameters(), FIELD), Pose2D()
    world = WorldState(5, RobotEstimate(pose, np.eye(3) * 1e-4, pose), seen_object(pose, (1.5, 0.0), (0.0, 0.0)), ())
    user = UserCommand(0, UserRequest.PLAY)
    strategy.decide(5, world, game_state(5), user, motion_state(5, MotionMode.STAND))
    behind = strategy.tree.names.index("behind the ball")
    assert strategy.tree.statuses[behind] is not NodeStatus.IDLE
    strategy.decide(6, world, game_state(6, GamePhase.SET), user, motion_state(6, MotionMode.STAND))
    assert strategy.tree.statuses[behind] is NodeStatus.IDLE


def test_a_message_brings_the_tree_across() -> None:
    state, _ = after(GamePhase.PLAYING)
    assert tree_from_message(tree_to_message(state)) == state


def test_the_terminal_shows_what_was_asked_and_the_whole_tree_on_demand() -> None:
    state, path = after(GamePhase.PLAYING)
    texts = []
    for whole in (False, True):
        console = Console(width=200, record=True, file=open("/dev/null", "w"))
        console.print(terminal_tree(state, whole))
        texts.append(console.export_text())
    assert all(name in texts[0] for name in path.split(" > "))
    assert "kick to the target" not in texts[0]
    assert all(name in texts[1] for name in STRATEGIES)
    assert len(texts[1].splitlines()) == len(state.names)


def test_a_diagram_draws_each_node_of_its_branch_once() -> None:
    state, _ = after(GamePhase.PLAYING)
    root = state.names.index("goalkeeper")
    text = mermaid(state, root)
    inside = {root}
    for index, parent in enumerate(state.parents):
        if parent in inside:
            inside.add(index)
    assert text.count("-->") == len(inside) - 1
    assert all(text.count(f"    n{index}[") + text.count(f"    n{index}([") == 1 for index in inside)
    assert state.kinds[root] is NodeKind.SELECTOR
    assert mermaid(state, 0, depth=1).count("-->") == sum(parent == 0 for parent in state.parents)


def test_a_tree_that_is_not_used_any_more_leaves_nothing_behind() -> None:
    before = len(Blackboard.clients)  # py_trees keeps them in its class, for ever
    for _ in range(3):
        Strategy(StrategyParameters(), FIELD)
    assert len(Blackboard.clients) == before
