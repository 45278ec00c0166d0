"""The menu over real nodes: user input, motion control and the simulator, which come and go; and a second face."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from menu_screen import Screen, use_menu

from tulip_msgs.msg import GroundTruth, UserCommand
from tulip_ros import topics
from tulip_ros.launch import Launcher
from tulip_ros.log_file import Log
from tulip_ros.plan import make_plan
from tulip_view.menu.robot_link import RobotLink, linked

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("ros_domain")]

SECOND_FACE = UserCommand(request=UserCommand.PLAY, strategy="goalkeeper")
STRENGTH = 8.0  # [N s]
MASS = 23.0  # [kg]


@contextmanager
def running(
    logs: Path, *nodes: str, driver: str | None = None, values: dict[str, dict[str, Any]] | None = None
) -> Iterator[Launcher]:
    own = {"driver": {"scenario": "open", "camera": False, "referee": False, "wait_for": list(nodes)}} if driver else {}
    with Launcher(make_plan(list(nodes), driver, values={**own, **(values or {})}), logs) as launcher:
        yield launcher


class Ears:
    """What the robot's topics say, heard by the menu's own node, and a second face."""

    def __init__(self, robot: RobotLink) -> None:
        self.commands: list[UserCommand] = []
        self.truths: list[GroundTruth] = []
        topics.USER_COMMAND.subscribe_from(robot, self.commands.append)
        topics.GROUND_TRUTH.subscribe_from(robot, self.truths.append)
        self.other_face = topics.USER_WISH.publish_from(robot)

    def says(self, request: int) -> bool:
        return bool(self.commands) and self.commands[-1].request == request

    def greatest_speed(self, direction: float) -> float:
        """Return the trunk's greatest speed so far towards a direction as the robot sees it [rad]."""
        return max(_speed(truth, direction) for truth in self.truths)


def _speed(truth: GroundTruth, direction: float) -> float:
    turn, speed = truth.robot.orientation, truth.robot_twist.linear
    direction += 2.0 * math.atan2(turn.z, turn.w)  # it stands upright
    return speed.x * math.cos(direction) + speed.y * math.sin(direction)


def test_menu_waits_for_user_input_agrees_with_a_second_face_and_goes_on_after_a_restart(tmp_path: Path):
    async def use(screen: Screen) -> None:
        await screen.until_text("error: node user_input does not run in no namespace of ROS_DOMAIN_ID", "launch.py")
        await screen.press("s")
        assert "play: not done (node user_input does not run" in screen.text
        with running(tmp_path / "first", "user_input"):
            await screen.until_text("wish stop", "user_input ok")
            await screen.press("w", "up", "q")
            await screen.until(lambda: ears.commands and list(ears.commands[-1].velocity) == [0.05, 0.0, 0.1])
            await screen.until_text("walk test: taken", "forward +0.05", "turn +0.1")
            await screen.until(lambda: ears.other_face.get_subscription_count())
            ears.other_face.publish(SECOND_FACE)
            await screen.until_text("wish play goalkeeper", "w begins the walk test")
            for key, words in (
                ("r", "recording: not done (no recorder runs"),
                ("i1", "identification: not done (node identify does not run"),
                ("p", "Push the simulated robot"),
                ("up", "push forward: not done (no simulator of a single robot runs"),
            ):
                await screen.press(*([key] if key == "up" else key))
                await screen.until_text(words)
            await screen.press("l")
            await screen.until(lambda: ears.says(UserCommand.LIMP))
            await screen.until_text(
                "emergency stop: sent", "wish LIMP", "emergency stop by menu (key l); o releases it"
            )
            await screen.press("u")
            await screen.until_text("stand: refused (emergency stop by menu (key l); release it first)")
            await screen.press("o")
            await screen.until_text("release: taken")
            await screen.until(lambda: "o releases it" not in screen.text)
            await screen.press("o")
            await screen.until_text("release: refused (no emergency stop holds")
            await screen.press("l")
        await screen.until_text("node user_input does not run", "user_input silent")
        with running(tmp_path / "second", "user_input"):
            # A new user_input hears of the stop from the menu.
            await screen.until_text("wish LIMP", "emergency stop by menu")
            await screen.until(lambda: "does not run" not in screen.text)
            await screen.until(lambda: re.search(r"user_input error +\d", screen.text))  # it has heard of it
            await screen.press("o")
            await screen.until_text("release: taken")
            await screen.press("u")
            await screen.until(lambda: ears.says(UserCommand.STAND))
            await screen.until_text("stand: taken")

    with linked("") as robot:
        ears = Ears(robot)
        use_menu(robot, use)


def test_robot_in_another_namespace_is_named(tmp_path: Path):
    async def use(screen: Screen) -> None:
        await screen.until_text("in namespace /keeper of ROS_DOMAIN_ID", "but robots do with no --namespace")

    with running(tmp_path, "user_input"), linked("keeper") as robot:
        use_menu(robot, use)


@pytest.mark.sim
@pytest.mark.parametrize(("key", "direction"), [("left", math.pi / 2), ("down", math.pi)])
def test_push_moves_the_simulated_robot_the_way_it_says(tmp_path: Path, key: str, direction: float):
    async def use(screen: Screen) -> None:
        await screen.until_text("legs stand", "time 1 s")
        await screen.press("p", *["plus"] * 8)
        assert f"{STRENGTH:.1f} N s" in screen.text
        assert ears.greatest_speed(direction) < 0.25 * STRENGTH / MASS
        await screen.press(key)
        await screen.until_text(": taken")
        await screen.until(lambda: ears.greatest_speed(direction) > 0.5 * STRENGTH / MASS)

    with running(tmp_path, "motion", "user_input", driver="sim"), linked("") as robot:
        ears = Ears(robot)
        use_menu(robot, use)


@pytest.mark.sim
def test_identification_is_begun_watched_recorded_and_ended_by_limp(tmp_path: Path):
    async def use(screen: Screen) -> None:
        await screen.until_text("identification: i begins", "not recording")
        await screen.press("r")
        await screen.until_text("recording: taken", "RECORDING")
        await screen.press("i", "1")
        await screen.until_text("identification: taken", "identification 0/18, shift")
        await screen.press("l")
        await screen.until_text("identification 0/18, aborted: emergency stop by menu (key l)")
        await screen.press("i", "1")
        await screen.until_text("identification: refused (emergency stop by menu (key l); release it first)")
        await screen.press("r")
        await screen.until_text("end of the recording: taken", "not recording")

    values = {
        "identify": {"plan.postures": 9, "plan.candidates": 40, "at_once": False},
        "recorder": {"start": False, "folder": str(tmp_path / "recordings")},
    }
    with (
        running(tmp_path, "identify", "user_input", "recorder", driver="sim", values=values),
        linked("") as robot,
    ):
        use_menu(robot, use)
    (file,) = (tmp_path / "recordings").glob("*/*.mcap")
    with Log(file) as log:
        assert log.topics["/identification/progress"].messages > 0
