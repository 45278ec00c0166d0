"""The menu's keys and screen with textual's pilot, over the real core of user input; without ROS."""

from __future__ import annotations

import ast
from collections.abc import Awaitable, Callable
from dataclasses import replace
from pathlib import Path

import pytest
from menu_screen import Screen, use_menu

from tulip_motion.identification.passages import Doing
from tulip_motion.identification.progress import Progress
from tulip_strategy.behaviour.tree import STRATEGIES
from tulip_strategy.interface import UserCommand, UserRequest
from tulip_strategy.user_input import UserInput, UserInputParameters, Wish
from tulip_view.menu import app
from tulip_view.menu.dialogs import Choice, Pushes
from tulip_view.menu.sight import NodeLine, Said, Sight
from tulip_view.menu.speeds import Speeds
from tulip_view.outcome import Outcome

UNDER_WAY = Progress(Doing.MOVE, 3, 18, 2, (), 61.0, "", None, False)
NODES = ("driver", "vision", "worldmodel", "head", "motion", "strategy", "game_input", "user_input", "aggregator",
         "bridge", "view", "recorder")  # fmt: skip


class CoreRobot:
    """User input's own core answers at once; the rest takes notes."""

    def __init__(self) -> None:
        self.user = UserInput(UserInputParameters(), tuple(STRATEGIES))
        self.sight = Sight(command=self.user.command)
        self.wishes: list[Wish] = []
        self.pushes: list[tuple[str, float]] = []
        self.records: list[bool] = []
        self.experiments: list[bool] = []
        self.deaf = False
        self.stops: list[str] = []

    def look(self) -> Sight:
        return self.sight

    def wish(self, wish: Wish) -> None:
        self.wishes.append(wish)
        if self.deaf:
            return
        refusal = self.user.ask(0, wish.request, wish.strategy, wish.velocity, wish.argument)
        self.tell(Outcome(wish.request.name.lower(), "refused" if refusal else "taken", refusal))

    def tell(self, outcome: Outcome) -> None:
        self.sight = replace(self.sight, command=self.user.command, outcomes=(outcome, *self.sight.outcomes))

    def emergency_stop(self, reason: str) -> None:
        self.stops.append(reason)
        self.user.stop(0, f"emergency stop by menu ({reason})")
        self.sight = replace(self.sight, stop=f"emergency stop by menu ({reason})")
        self.tell(Outcome("emergency stop", "sent"))

    def release(self) -> None:
        self.user.release()
        self.sight = replace(self.sight, stop="")
        self.tell(Outcome("release", "taken"))

    def push(self, direction: str, size: float) -> None:
        self.pushes.append((direction, size))
        self.tell(Outcome(f"push {direction}", "not done", "no simulator"))

    def record(self, begin: bool) -> None:
        self.records.append(begin)
        self.sight = replace(self.sight, recording="trial.mcap" if begin else "")

    def identify(self, begin: bool) -> None:
        self.experiments.append(begin)


def using(robot: CoreRobot) -> Callable[[Callable[[Screen], Awaitable[None]]], None]:
    """Use the menu for this robot right away: a decorator."""
    return lambda use: use_menu(robot, use)


def test_each_key_sends_its_wish_and_the_answer_is_shown():
    robot = CoreRobot()

    @using(robot)
    async def _(screen: Screen) -> None:
        for key, shown in (("s", "play: taken"), ("x", "stop: taken"), ("u", "stand: taken"), ("d", "limp: taken")):
            await screen.press(key)
            assert shown in screen.text
        assert " LIMP " in screen.text.splitlines()[2]
        await screen.press("c", "2")
        assert "play goalkeeper" in screen.text
        await screen.press("c", "down", "down", "enter", "k", "1")
        assert "kick test left" in screen.text

    assert robot.wishes == [
        Wish(UserRequest.PLAY),
        Wish(UserRequest.STOP),
        Wish(UserRequest.STAND),
        Wish(UserRequest.LIMP),
        Wish(UserRequest.PLAY, strategy=list(STRATEGIES)[1]),
        Wish(UserRequest.PLAY, strategy=list(STRATEGIES)[2]),
        Wish(UserRequest.KICK_TEST, argument="left"),
    ]


@pytest.mark.parametrize("opened", ["", "c", "k", "p", "i"])
@pytest.mark.parametrize("key", ["l", "L"])
def test_the_emergency_stop_is_one_key_away_whatever_is_open_and_closes_it(opened: str, key: str):
    robot = CoreRobot()

    @using(robot)
    async def _(screen: Screen) -> None:
        if opened:
            await screen.press(opened)
            assert "Esc leaves" in screen.text
        await screen.press(key)
        assert "Esc leaves" not in screen.text and "emergency stop: sent" in screen.text

    assert robot.stops == ["key l"] and robot.wishes == []


def test_an_emergency_stop_is_shown_and_holds_until_it_is_released():
    robot = CoreRobot()

    @using(robot)
    async def _(screen: Screen) -> None:
        await screen.press("s", "l")
        first = " ".join(screen.text.split())
        assert "emergency stop by menu (key l); o releases it" in first and "wish LIMP" in first
        await screen.press("u")
        assert "stand: refused (emergency stop by menu (key l); release it first)" in " ".join(screen.text.split())
        await screen.press("o")
        assert "o releases it" not in screen.text and "wish LIMP" in " ".join(screen.text.split())
        await screen.press("u")
        assert "stand: taken" in screen.text


def test_walk_test_follows_the_keys_within_its_limits():
    robot = CoreRobot()

    @using(robot)
    async def _(screen: Screen) -> None:
        await screen.press("up")
        assert not robot.wishes and "press w for the walk test first" in screen.text
        await screen.press("w", "up", "up", "left", "e", "e", "e")
        assert robot.user.command.velocity == pytest.approx((0.1, 0.05, -0.3), abs=1e-12)
        assert "forward +0.10" in screen.text and "left +0.05" in screen.text and "turn -0.3" in screen.text
        await screen.press("down", "down", "down", "right", "q")
        assert robot.user.command.velocity == pytest.approx((-0.05, 0.0, -0.2), abs=1e-12)
        await screen.press(*["left"] * 7, *["up"] * 20, *["q"] * 20)
        assert robot.user.command.velocity == UserInputParameters.walk_test_limits
        assert not any("refused" in str(outcome) for outcome in robot.sight.outcomes)
        await screen.press("space")
        assert robot.user.command == replace(robot.user.command, request=UserRequest.WALK_TEST, velocity=(0, 0, 0))
        await screen.press("x", "up")
        assert robot.user.command.request is UserRequest.STOP  # keys make nothing walk any more


def test_speeds_that_another_face_has_chosen_are_shown_and_changed_from_there():
    robot = CoreRobot()

    @using(robot)
    async def _(screen: Screen) -> None:
        await screen.press("w", "up")
        robot.user.ask(0, UserRequest.WALK_TEST, velocity=(-0.3, 0.1, 0.5))
        robot.tell(Outcome("walk test", "taken"))
        await screen.press("up")
        assert robot.user.command.velocity == pytest.approx((-0.25, 0.1, 0.5), abs=1e-12)
        robot.user.ask(0, UserRequest.PLAY, strategy="goalkeeper")
        robot.sight = replace(robot.sight, command=robot.user.command)
        await screen.until_text("play goalkeeper", "w begins the walk test")


@pytest.mark.parametrize("key", ["k", "p"])
def test_keys_that_wait_for_a_question_when_a_stop_closes_it_have_no_effect(key: str):
    robot = CoreRobot()

    @using(robot)
    async def _(screen: Screen) -> None:
        await screen.press(key)
        question = screen.app.screen
        assert isinstance(question, Choice | Pushes)
        await screen.press("l")
        if isinstance(question, Pushes):
            question.action_push("forward")
        else:
            question.end("left")
        question.action_leave()
        assert robot.pushes == [] and robot.wishes == [] and robot.stops == ["key l"]


def command(velocity: tuple[float, float, float], sequence: int) -> UserCommand:
    return UserCommand(0, UserRequest.WALK_TEST, velocity=velocity, sequence=sequence)


def test_keys_pressed_faster_than_the_robot_answers_add_up():
    speeds = Speeds()
    speeds.hear(command((0.0, 0.0, 0.0), 1))
    for _ in range(3):
        speeds.change(0, 1)
    speeds.hear(command((0.05, 0.0, 0.0), 2))  # the first of three has arrived
    assert speeds.change(0, 1) == (0.2, 0.0, 0.0)
    speeds.hear(command((0.2, 0.0, 0.0), 5))
    speeds.hear(command((0.4, 0.0, 0.0), 6))  # another face's
    assert speeds.change(0, 1) == (0.45, 0.0, 0.0)
    speeds.forget()  # it was refused
    assert speeds.wanted == (0.4, 0.0, 0.0)


def test_walking_asked_for_before_limp_does_not_bring_the_walk_test_back():
    speeds = Speeds()
    speeds.hear(command((0.0, 0.0, 0.0), 1))
    speeds.change(0, 1)
    speeds.leave()  # limp was sent
    speeds.hear(command((0.05, 0.0, 0.0), 2))
    assert not speeds.in_walk_test
    speeds.hear(UserCommand(0, UserRequest.LIMP, sequence=3))
    assert not speeds.in_walk_test
    speeds.hear(command((0.1, 0.0, 0.0), 4))  # another face's
    assert speeds.in_walk_test


def test_a_refusal_is_shown_with_its_reason_and_takes_the_speed_back():
    robot = CoreRobot()
    robot.user = UserInput(UserInputParameters(walk_test_limits=(0.07, 0.2, 1.0)), tuple(STRATEGIES))

    @using(robot)
    async def _(screen: Screen) -> None:
        await screen.press("w", "up", "up")
        assert "refused (forward velocity is 0.1 m/s; expected -0.07 to 0.07)" in " ".join(screen.text.split())
        assert "forward +0.05" in screen.text


def test_pushes_go_the_way_of_the_arrows_as_hard_as_chosen():
    robot = CoreRobot()

    @using(robot)
    async def _(screen: Screen) -> None:
        await screen.press("p", "left", "plus", "plus", "up", "minus", "down", "right")
        assert "not done (no simulator)" in screen.text  # seen although the question is open
        await screen.press("escape", "up")

    assert robot.pushes == [("to the left", 4.0), ("forward", 5.0), ("backward", 4.5), ("to the right", 4.5)]


def test_one_key_begins_and_ends_a_recording():
    robot = CoreRobot()

    @using(robot)
    async def _(screen: Screen) -> None:
        assert "no recorder" in screen.text
        await screen.press("r")
        assert "RECORDING" in screen.text
        await screen.press("r")
        assert "not recording" in screen.text

    assert robot.records == [True, False]


def test_identification_is_begun_and_ended_by_choice_and_its_end_is_told():
    robot = CoreRobot()

    @using(robot)
    async def _(screen: Screen) -> None:
        await screen.press("i", "escape", "i", "1", "i", "2")
        robot.sight = replace(robot.sight, experiment=replace(UNDER_WAY, reason="on request", finished=True))
        await screen.until_text("identification 2/18, aborted: on request")

    assert robot.experiments == [True, False]


def test_all_nodes_can_be_seen_on_a_small_terminal_and_words_tell_what_colours_stress():
    robot = CoreRobot()
    lines = tuple(NodeLine(name, "ok", "250 imu", "3.1", "0", "running") for name in NODES)
    broken = NodeLine("motion", "error", "0 imu", "3.1", "2", "no imu for 1.2 s: look after driver")
    said = Said("12:00:01", "motion", "error", "no imu for 1.2 s: look after driver")
    robot.sight = replace(
        robot.sight, state="error", sum="motion: no imu", said=(said,), nodes=(*lines[:4], broken, *lines[5:])
    )

    @using(robot)
    async def _(screen: Screen) -> None:
        first = screen.text
        assert "TUlip  error: motion: no imu" in first
        assert "12:00:01 motion error: no imu for 1.2 s: look after driver" in first
        (row,) = [line for line in first.splitlines() if line.startswith("motion")]
        assert row.split()[:6] == ["motion", "error", "0", "imu", "3.1", "2"]
        assert "recorder " not in first.split("says")[1]
        await screen.press("pagedown")
        assert "recorder" in screen.text.split("motion error:")[0]
        assert all(f"[{key}]" in screen.text for key in "loxudscwkpri")


def test_without_user_input_the_remedy_is_shown_and_nothing_hangs():
    robot = CoreRobot()
    robot.sight = replace(robot.sight, missing="Node user_input does not run. Start it.", command=None)
    robot.deaf = True

    @using(robot)
    async def _(screen: Screen) -> None:
        assert "error: Node user_input does not run. Start it." in screen.text
        await screen.press("w", "up", "s", "l")
        assert robot.stops == ["key l"] and "(Node user_input does not run. Start it.)" in " ".join(screen.text.split())
        robot.deaf, robot.sight = False, replace(robot.sight, missing="")
        await screen.press("o", "u")
        assert "stand: taken" in screen.text and "does not run" not in screen.text


@pytest.mark.parametrize("size", [(80, 24), (40, 10), (200, 60)])
def test_any_terminal_is_large_enough_to_stop(size: tuple[int, int]):
    robot = CoreRobot()

    async def use(screen: Screen) -> None:
        await screen.press("l")

    use_menu(robot, use, size)
    assert robot.stops == ["key l"]


def test_the_screen_and_its_questions_import_no_ros():
    folder = Path(app.__file__).parent
    for name in ("app", "dialogs", "panels", "sight", "speeds"):
        tree = ast.parse((folder / f"{name}.py").read_text())
        modules = [node.module or "" for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)]
        assert not [module for module in modules if module.startswith(("rclpy", "tulip_ros", "tulip_msgs"))], name
