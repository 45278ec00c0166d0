"""The table of faults is whole, and what a robot does is told rightly from how it was."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tulip_description.robot import JOINTS
from tulip_msgs.msg import MotionState
from tulip_ros import topics
from tulip_ros.nodes import DRIVER, NODES
from tulip_sim.bench import faults
from tulip_sim.disturbance import Disturbance
from tulip_sim.disturber_node import disturbed, sent
from tulip_sim.fault_table import ROWS, Reaction
from tulip_sim.fault_trial import SECOND, SOFT, Sample, lies_softly, plan_of, reaction_of
from tulip_sim.faults import SensorFaults

STAND, WALK, FALLEN = MotionState.STAND, MotionState.WALK, MotionState.FALLEN


def life(*parts: tuple[float, int | None, float, bool]) -> list[Sample]:
    """Return samples at 50 Hz of parts that each last so long [s], in which who walks plays."""
    found: list[Sample] = []
    for seconds, mode, torque, fallen in parts:
        for _ in range(round(50 * seconds)):
            found.append(Sample((len(found) + 1) * SECOND // 50, mode, torque, fallen, mode == WALK))
    return found


@pytest.mark.parametrize(
    ("samples", "reaction"),
    [
        (life((8.0, WALK, 30.0, False)), Reaction.GOES_ON),
        (life((5.0, WALK, 30.0, False), (3.0, STAND, 10.0, False), (0.5, WALK, 30.0, False)), Reaction.GOES_ON),
        (life((5.0, WALK, 30.0, False), (3.0, STAND, 10.0, False)), Reaction.STANDS),
        (life((1.0, WALK, 30.0, False), (3.0, FALLEN, 0.2, True)), Reaction.LIMP),
        (life((1.0, WALK, 30.0, False), (3.0, None, 0.2, True)), Reaction.LIMP),
        (life((1.0, WALK, 30.0, False), (3.0, FALLEN, 0.2, False)), Reaction.LIMP),  # it sank, and leans on something
        (life((1.0, WALK, 30.0, False), (3.0, None, 30.0, False)), None),  # nobody knows, and there is torque
        (life((1.0, WALK, 30.0, False), (3.0, WALK, 30.0, True)), None),  # walks lying
        (life((1.0, WALK, 30.0, False), (2.0, FALLEN, 0.2, True), (3.0, WALK, 30.0, False)), None),  # fell, was set up
        (life((1.0, WALK, 30.0, False), (3.0, FALLEN, 20.0, True)), None),  # has torque where it should have none
        ([], None),
    ],
)
def test_what_the_robot_does_is_told_from_how_it_was(samples: list[Sample], reaction: Reaction | None) -> None:
    assert reaction_of(samples) is reaction


def test_who_stands_to_look_for_the_ball_plays_and_who_walks_on_without_being_told_does_not() -> None:
    walks, looks = life((5.0, WALK, 30.0, False)), life((8.0, STAND, 10.0, False))[250:]
    assert reaction_of([*walks, *(sample._replace(plays=True) for sample in looks)]) is Reaction.GOES_ON
    assert reaction_of([sample._replace(plays=False) for sample in walks]) is None
    assert reaction_of([sample._replace(plays=True) for sample in looks]) is None  # and has not moved at all


def test_a_robot_lies_softly_without_torque_from_a_second_after_its_fall_on() -> None:
    assert lies_softly(life((3.0, WALK, 30.0, False)))
    assert lies_softly(life((1.0, WALK, 30.0, False), (0.9, FALLEN, 30.0, True), (3.0, FALLEN, 0.2, True)))
    assert not lies_softly(life((1.0, WALK, 30.0, False), (2.0, FALLEN, 0.2, True), (0.1, WALK, 2 * SOFT, True)))


def test_each_row_can_be_made_to_happen() -> None:
    names = {topic.name for topic in topics.TOPICS}
    assert len({row.name for row in ROWS}) == len(ROWS)
    for row in ROWS:
        assert row.seconds > 0.0
        assert sum(map(bool, (row.node, row.sensor, row.disturbed, row.no_room))) == 1, row.name
        assert bool(row.node) == (row.way is not None)
        assert set(row.disturbed) <= names
        known = {DRIVER, *NODES}
        assert {row.node, row.tells[0], row.no_room} - {""} <= known
        if row.sensor:
            SensorFaults([f"{row.sensor} 1"], JOINTS)


def test_plans_of_rows_put_a_disturber_between_all_senders_and_their_listeners(tmp_path) -> None:
    row = next(row for row in ROWS if row.free and row.disturbed)
    plan = {start.name: start for start in plan_of(row, 1, tmp_path)}
    driver, motion = plan["driver"], plan["motion"]
    assert ("joint_states", "joint_states/sent") in driver.renamed
    assert motion.renamed == (("legs/joint_command", "legs/joint_command/sent"),)
    assert plan["disturber"].parameters["topics"] == list(row.disturbed)
    assert driver.parameters["mode"] == "free"
    command = motion.command(tmp_path / "motion.yaml")
    assert command[command.index("-r") + 1] == "legs/joint_command:=legs/joint_command/sent"


def test_only_senders_are_renamed(tmp_path) -> None:
    plan = disturbed(plan_of(None, 1, tmp_path), ["features"])
    assert {start.name: start.renamed for start in plan if start.renamed} == {
        "vision": (("features", sent("features")),)
    }


def way(kind: str, share: float, hold: int = 1) -> list[int]:
    disturbance: Disturbance[int] = Disturbance(kind, share, hold, np.random.default_rng(1))
    return [arrived for number in range(1000) for arrived in disturbance.pass_on(number)]


def test_messages_are_lost_doubled_late_or_overtaken_as_often_as_wished() -> None:
    assert way("none", 1.0) == list(range(1000))
    lost = way("lost", 0.2)
    assert lost == sorted(lost) and 750 < len(lost) < 850
    doubled = way("doubled", 0.2)
    assert doubled == sorted(doubled) and 1150 < len(doubled) < 1250
    assert way("late", 0.2, hold=3) == list(range(997))
    mixed = way("out of order", 0.2, hold=2)
    assert mixed != sorted(mixed)
    assert set(range(990)) <= set(mixed) and len(set(mixed)) == len(mixed)  # the last may still be held
    places = {number: place for place, number in enumerate(mixed)}
    behind = max(places[number] - number for number in range(990))
    assert 1 <= behind <= 2  # overtaken by two messages at most


@pytest.mark.parametrize(("kind", "share", "hold"), [("slow", 0.1, 1), ("lost", 1.5, 1), ("late", 0.1, 0)])
def test_disturbances_that_are_none_are_refused(kind: str, share: float, hold: int) -> None:
    with pytest.raises(ValueError, match="expected"):
        Disturbance(kind, share, hold, np.random.default_rng(1))


def test_the_bench_can_be_had_in_parts() -> None:
    assert len(faults.choose({"rounds": "2"})) == len(faults.trials()) - faults.ROUNDS + 2
    assert faults.choose({"only": "camera gone"}) == [("row", "camera gone")]
    assert faults.choose({"only": "vision killed", "rounds": "1"}) == [("kills 1", "vision killed")]
    assert faults.choose({"only": "disk"}) == [(faults.FROM_OUTSIDE, "disk")]
    for options, words in (({"only": "("}, "no regular expression"), ({"only": "xyz"}, "expected part of a name")):
        with pytest.raises(ValueError, match=words):
            faults.choose(options)
    for options in ({"rounds": "many"}, {"hours": "3"}):
        with pytest.raises(ValueError, match="expected"):
            faults.choose(options)


def test_the_bench_counts_what_it_saw() -> None:
    kill = {
        "node": "vision",
        "back [s]": 1.0,
        "safe": True,
        "upright": True,
        "plays on": True,
        "plays on after [s]": 4.0,
    }
    row = {
        "fault": "camera gone",
        "stated": "stands still",
        "observed": "goes on",
        "told": True,
        "fell": False,
        "watched [s]": 8.0,
        "wall clock [s]": 9.0,
    }
    other = {**kill, "back [s]": None, "safe": False, "plays on": False, "plays on after [s]": None}
    lines = "\n".join(
        faults.summarize([{"kills": [kill, other]}, {"rows": [row, {**row, "observed": "stands still"}]}])
    )
    assert "| vision | 2 | 1.00 (1.00) | 1 | 2 | 1 | 4.00 (4.00) |" in lines
    assert "1 of 2 as stated" in lines
    assert re.search(r"\| camera gone \| stands still \| goes on \| yes \| no \|", lines)
