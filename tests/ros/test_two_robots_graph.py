"""A match of two robots as a graph: every node twice, in namespaces, one simulator that waits for both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from graph_trial import free_port, left_in_shared_memory, shared_memory
from rosbags.highlevel import AnyReader

from tulip_ros import topics
from tulip_sim.match_graph import NODES
from tulip_sim.match_report import MatchReport
from tulip_sim.match_rules import NAMESPACES, MatchRules
from tulip_sim.match_two_graph import match_plan, play_match_graph
from tulip_sim.messages import report_from_message

SHORT = MatchRules(
    trials=2,
    extra_pairs=0,
    initial_time=1.2,
    ready_time=0.2,
    set_time=0.4,
    playing_time=0.6,
    finished_time=0.4,
    lying_limit=1.0,
    removal_time=1.0,
)


def test_the_plan_of_a_match_holds_two_whole_robots_that_differ_in_what_their_teams_differ_in() -> None:
    plan = match_plan(1, SHORT, Path("somewhere"))
    assert [start.full_name for start in plan] == [
        "recorder",
        "driver",
        *(f"{namespace}/{name}" for namespace in NAMESPACES for name in NODES),
    ]
    values = {start.full_name: start.parameters for start in plan}
    assert all(values[f"{space}/{name}"]["use_sim_time"] for space in NAMESPACES for name in NODES)
    colours = [values[f"{space}/vision"]["opponents"]["team_colour"] for space in NAMESPACES]
    assert colours == ["cyan", "magenta"]
    assert [values[f"{space}/worldmodel"]["field_turned"] for space in NAMESPACES] == [False, True]
    assert [values[f"{space}/strategy"]["field_turned"] for space in NAMESPACES] == [False, True]
    ports = [values[f"{space}/game_input"]["port"] for space in NAMESPACES]
    assert ports == [values["driver"]["referee_port"], values["driver"]["second_referee_port"]]


@pytest.mark.ros
@pytest.mark.sim
@pytest.mark.slow
@pytest.mark.usefixtures("ros_domain")
def test_a_short_match_runs_to_its_end_and_is_recorded_in_two_namespaces(tmp_path: Path) -> None:
    before = shared_memory()
    record = tmp_path / "match"
    ports = (free_port(), free_port())
    plan = match_plan(1, SHORT, record, referee_ports=ports, keeper="dribble_and_kick")
    said: list[str] = []
    summary = play_match_graph(plan, 1, record, say=said.append, logs=tmp_path / "logs")
    assert [(trial.striker, trial.result) for trial in summary.report.trials] == [(0, "time"), (1, "time")]
    assert summary.report.decided_by == "draw"
    assert said == [str(line) for line in summary.report.log]  # and no node died
    assert max(summary.localization_errors) < 0.2
    assert left_in_shared_memory(before) == set()
    counts: dict[str, int] = {}
    report = MatchReport()
    wishes: dict[str, list[str]] = {space: [] for space in NAMESPACES}
    with AnyReader([record]) as reader:
        for connection, _, raw in reader.messages():
            counts[connection.topic] = counts.get(connection.topic, 0) + 1
            if connection.topic == f"/{topics.REPORT.name}":
                report = report_from_message(reader.deserialize(raw, connection.msgtype))  # type: ignore[arg-type]
            for space in NAMESPACES:
                if connection.topic == f"/{space}/{topics.USER_COMMAND.name}":
                    wish = reader.deserialize(raw, connection.msgtype)
                    wishes[space].append({0: "play", 1: "stop", 2: "stand", 5: "limp"}[wish.request])
    assert report == summary.report
    for space in NAMESPACES:
        # The first wish, to do nothing, may be replaced before the recorder has found the node that said it.
        assert wishes[space][-6:] == ["limp", "stand", "play"] * 2
        assert wishes[space][:-6] in ([], ["stop"])
        assert counts[f"/{space}/initialpose"] == 2
        assert counts[f"/{space}/features"] > 20
        assert counts[f"/{space}/game_state"] > 6
    assert counts["/striker/joint_states"] == pytest.approx(counts["/keeper/joint_states"], rel=0.1)


def test_rules_that_make_no_match_are_refused() -> None:
    with pytest.raises(ValueError, match="playing_time is 0"):
        replace(SHORT, playing_time=0.0)
