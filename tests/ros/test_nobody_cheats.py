"""No part of the robot that plays can know what it did not sense."""

from __future__ import annotations

import ast
import importlib.util
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from graph_trial import free_port

from tulip_ros import topics
from tulip_ros.launch import Launcher
from tulip_ros.nodes import NODES, ROBOT
from tulip_ros.run import ComponentNode, session
from tulip_sim.match_graph import trial_plan

WAIT = 60.0  # [s] of wall-clock time for the nodes to start
EVERY_NODES = {"/rosout", "/parameter_events", "/clock", "/diagnostics"}
PLAYING_PACKAGES = sorted({NODES[name].package for name in ROBOT} | {"tulip_description"})


def of_the_graph(names_and_types: list[tuple[str, list[str]]]) -> set[str]:
    return {name for name, _ in names_and_types if "/_action/" not in name} - EVERY_NODES


@pytest.mark.ros
@pytest.mark.slow
def test_no_playing_node_listens_to_the_truth_and_each_hears_and_says_what_is_declared(
    ros_domain: int, tmp_path: Path
) -> None:
    plan = [start for start in trial_plan(1, referee_port=free_port()) if start.name != "driver"]
    with (
        Launcher(plan, tmp_path) as launcher,
        session(lambda: ComponentNode("asker"), ["test"], handle_signals=False) as (node, spin),
    ):
        hears: dict[str, set[str]] = {}
        says: dict[str, set[str]] = {}
        declared_ears = {name: {f"/{each.name}" for each in topics.heard_by(name)} - {"//clock"} for name in ROBOT}
        declared_mouths = {name: {f"/{each.name}" for each in topics.published_by(name)} for name in ROBOT}
        declared_mouths = {name: each - EVERY_NODES for name, each in declared_mouths.items()}
        end = time.monotonic() + WAIT
        while (hears, says) != (declared_ears, declared_mouths) and time.monotonic() < end:
            spin(0.1)
            assert launcher.poll() == []
            there = {name for name, _ in node.get_node_names_and_namespaces()}
            for name in set(ROBOT) & there:
                hears[name] = of_the_graph(node.get_subscriber_names_and_types_by_node(name, "/"))
                says[name] = of_the_graph(node.get_publisher_names_and_types_by_node(name, "/"))
        assert hears == declared_ears
        assert says == declared_mouths
        assert node.get_subscriptions_info_by_topic("/ground_truth") == []
        topics.GROUND_TRUTH.subscribe_from(node, lambda _: None)  # the graph does tell who listens
        while not (listeners := node.get_subscriptions_info_by_topic("/ground_truth")) and time.monotonic() < end:
            spin(0.1)
        assert [each.node_name for each in listeners] == ["asker"]


def modules(package: str) -> Iterator[Path]:
    spec = importlib.util.find_spec(package)
    assert spec is not None and spec.submodule_search_locations
    for folder in spec.submodule_search_locations:
        yield from Path(folder).rglob("*.py")


def imported_by(path: Path) -> set[str]:
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            names.add("." * node.level + (node.module or ""))
    return names


@pytest.mark.parametrize("package", PLAYING_PACKAGES)
def test_no_playing_package_imports_the_simulator(package: str) -> None:
    files = list(modules(package))
    assert len(files) > 3
    for path in files:
        cheats = {name for name in imported_by(path) if name.split(".")[0] in ("tulip_sim", "pybullet")}
        assert cheats == set(), path
        assert "GroundTruth" not in path.read_text(), path
