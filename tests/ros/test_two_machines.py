"""A robot and its operator on two computers: started, watched and steered over a cable, which is cut and mended."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
import yaml
from graph_trial import SOON
from two_machines import ADDRESSES, Cable, Machine, NotAllowedError, Program, two_machines

from tulip_ros import topics
from tulip_ros.log_file import Log
from tulip_ros.time import stamp_of
from tulip_sim.bench.faces_lookers.looker import READY
from tulip_view.live.beside import PORT

pytestmark = [pytest.mark.ros, pytest.mark.sim, pytest.mark.slow]

SCRIPTS = Path(__file__).parents[2] / "scripts"
NODES = ("perception", "worldmodel", "head", "motion", "strategy", "game_input", "user_input")
VALUES = {
    # Without camera, so that the test asks for no more of a computer than the robot's control does.
    "driver": {"scenario": "open", "camera": False, "wait_for": list(NODES), "rules": {**SOON, "playing_time": 600.0}}
}
ROBOT, OPERATOR = ADDRESSES
WATCHED = 3.0  # [s] of the robot's time over which its speed is measured
FORGOTTEN = 22.0  # [s] of wall-clock time after which both sides have forgotten each other
LATE = 4.0  # [s] of the robot's time in which what waited for the link would have come
KNOCKS = 5.0  # [s] in which each node has asked at least three times who is there
LIMP = ("limp", "fallen")  # it falls soon, with nobody to hold it
PATIENCE = 120.0  # [s] of wall-clock time; what is waited for takes some seconds


class Seat:
    """A menu in a process of one of the machines."""

    def __init__(self, machine: Machine, log: Path, *peers: str) -> None:
        self._program = machine.start(sys.executable, str(Path(__file__).with_name("menu_seat.py")), *peers, log=log)
        self._log = log

    def press(self, *keys: str) -> dict[str, Any]:
        """Press keys and return what there is to see afterwards."""
        answer = self._program.ask(" ".join(("press", *keys)))
        assert answer, f"the menu has ended: {self._log.read_text()}"
        return dict(json.loads(answer))

    def until(self, holds: Callable[[dict[str, Any]], object]) -> dict[str, Any]:
        """Wait until something holds of what there is to see."""
        end = time.monotonic() + PATIENCE
        while not holds(seen := self.press()):
            assert time.monotonic() < end, f"it did not come to hold: {seen}"
            time.sleep(0.05)
        return seen


def launch(machine: Machine, log: Path, *arguments: str) -> Program:
    """Start launch.py in a machine."""
    return machine.start(sys.executable, str(SCRIPTS / "launch.py"), *arguments, "--logs", f"{log}_logs", log=log)


def page_shows(machine: Machine) -> bool:
    """Return whether a program that takes all that the page sends gets something; a busy machine's page comes late."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        if machine.start(sys.executable, "-m", "tulip_sim.bench.faces_lookers.page", str(PORT)).ask() == READY:
            return True
    return False


@pytest.fixture
def cable(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Cable]:
    for name in ("ROS_DOMAIN_ID", "ROS_AUTOMATIC_DISCOVERY_RANGE", "FASTRTPS_DEFAULT_PROFILES_FILE"):
        monkeypatch.delenv(name, raising=False)  # the machines have networks of their own
    monkeypatch.setenv("TULIP_NO_VENV", "1")
    monkeypatch.setenv("TMPDIR", str(tmp_path))  # whatever is killed in them leaves nothing behind
    try:
        with two_machines() as made:
            yield made
    except NotAllowedError as error:
        pytest.skip(f"two machines cannot be made here: {error}")


def test_the_operator_steers_over_the_cable_and_the_robot_plays_on_without_it(cable: Cable, tmp_path: Path) -> None:
    parameters = tmp_path / "robot.yaml"
    parameters.write_text(yaml.safe_dump(VALUES))
    of_robot = launch(cable.robot, tmp_path / "robot", *NODES, "--parameters", str(parameters), "--network", OPERATOR)
    record = tmp_path / "record"
    of_operator = launch(cable.operator, tmp_path / "operator", "view", "--record", str(record), "--network", ROBOT)
    operator = Seat(cable.operator, tmp_path / "operator_menu", ROBOT)
    robot = Seat(cable.robot, tmp_path / "robot_menu")  # at the robot's own console: sees what happens without a cable

    # All comes over the cable, and the page shows it.
    operator.until(lambda seen: seen["mode"] == "stand" and not seen["missing"] and seen["time"] > 2.0)
    assert page_shows(cable.operator)

    # The operator starts the robot. The cable is cut for longer than it takes to be forgotten; the robot plays on.
    operator.press("s")
    robot.until(lambda seen: seen["wish"] == "PLAY" and seen["mode"] == "walk")
    connected = speed(robot)
    cable.cut()
    cut_at, begin = robot.press()["time"], time.monotonic()
    operator.until(lambda seen: seen["time"] is None)
    alone = max(speed(robot), speed(robot))
    seen = robot.press()
    assert (seen["wish"], seen["mode"], seen["missing"]) == ("PLAY", "walk", "")
    print(f"the robot's time went {connected:.2f} times as fast as the wall clock, without the cable {alone:.2f}")
    assert alone > 0.5 * connected  # other programs come and go; a sender that waited for the operator would stand
    time.sleep(max(0.0, begin + FORGOTTEN - time.monotonic()))
    cable.mend()
    mended_at = time.monotonic()
    operator.until(lambda seen: seen["time"] is not None and seen["time"] > cut_at + WATCHED and not seen["missing"])
    print(f"the operator saw the robot again after {time.monotonic() - mended_at:.1f} s")
    operator.press("x")
    robot.until(lambda seen: seen["wish"] == "STOP" and seen["mode"] == "stand")

    # A walk test ends by itself when the operator is out of reach, and does not come back. A key that was pressed
    # meanwhile does nothing later.
    operator.press("w")
    operator.until(lambda seen: "walk test: taken" in seen["text"])
    operator.press("up")
    robot.until(lambda seen: seen["wish"] == "WALK_TEST" and seen["mode"] == "walk")
    walked = robot.press()["time"]
    robot.until(lambda seen: seen["time"] > walked + 2.0)  # for more than its lifetime, as the menu gives signs
    assert robot.press()["wish"] == "WALK_TEST"
    cable.lose()
    ended = robot.until(lambda seen: seen["wish"] == "STOP" and seen["mode"] == "stand")["time"]
    print(f"while all that it sends is lost {speed(robot):.2f} times")
    operator.press("s")
    operator.until(lambda seen: "play: not done" in seen["text"])
    cable.find()
    seen = operator.until(lambda seen: seen["time"] is not None and seen["time"] > ended + 1.0 and not seen["missing"])
    robot.until(lambda later: later["time"] > seen["time"] + LATE)
    assert robot.press()["wish"] == "STOP"

    # The page and the recorder, too, see the robot again.
    operator.press("l")
    limp = robot.until(lambda seen: seen["wish"] == "LIMP" and seen["mode"] in LIMP)["time"]
    operator.until(lambda seen: seen["mode"] in LIMP and seen["time"] > limp + 1.0)
    assert of_operator.end() == 0 and of_robot.end() == 0
    with Log(record) as log:
        messages = (log.decode(record) for record in log.records([f"/{topics.MOTION_STATE.name}"]))
        stamps = [stamp_of(message) * 1e-9 for message in messages]
    assert stamps[0] < cut_at - 1.0 and stamps[-1] > limp
    assert max(later - earlier for earlier, later in pairwise(stamps)) > WATCHED  # while the cable was cut


def test_a_robot_that_names_nobody_is_not_found_by_who_names_it(cable: Cable, tmp_path: Path) -> None:
    launch(cable.robot, tmp_path / "robot", "user_input", "--driver", "none")
    operator = Seat(cable.operator, tmp_path / "operator_menu", ROBOT)
    robot = Seat(cable.robot, tmp_path / "robot_menu")
    robot.until(lambda seen: not seen["missing"] and seen["wish"] == "STOP")
    operator.press()
    time.sleep(KNOCKS)
    seen = operator.press()
    assert seen["missing"] and not seen["wish"]


def speed(robot: Seat) -> float:
    """Return how fast the robot's time goes, by the wall clock."""
    first, begun = robot.press()["time"], time.monotonic()
    last = robot.until(lambda seen: seen["time"] > first + WATCHED)["time"]
    return float((last - first) / (time.monotonic() - begun))
