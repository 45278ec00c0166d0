"""What the menu shows, and what it needs of a robot. No ROS here, and no terminal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from tulip_motion.identification.progress import Progress
from tulip_strategy.interface import UserCommand
from tulip_strategy.user_input import Wish
from tulip_view.outcome import Outcome


@dataclass(frozen=True)
class NodeLine:
    """One node, in words.

    Attributes:
        name: As in "motion".
        state: "ok", "starting", "warning", "error" or "silent".
        fastest_input: As in "250 joint_states", "" for a node without inputs.
        processor: Share of a core [%].
        restarts: How many times it was started again; "" where nobody knows.
        says: Of itself.
    """

    name: str
    state: str
    fastest_input: str = ""
    processor: str = ""
    restarts: str = ""
    says: str = ""


@dataclass(frozen=True)
class Said:
    """What a node said when something was wrong, with the remedy where it knows one.

    Attributes:
        time: Of day, as in "12:30:59".
        node: Its name.
        state: As in `NodeLine`.
        words: What it said.
    """

    time: str
    node: str
    state: str
    words: str


@dataclass(frozen=True)
class Sight:
    """All that there is to see at an instant.

    Attributes:
        robot: Namespace, "" for a robot that is alone.
        missing: Why nobody takes wishes, and what to do; "" while user input is there.
        stop: The emergency stop in words, as in "emergency stop by menu (key l)"; "" while none holds.
        command: The user's wish that holds, whichever face it came from; None before the first is heard.
        game: The game in words, "" for none.
        doing: What strategy does; "" where it says nothing.
        mode: Of the legs, as in "walk"; "" where motion control says nothing.
        reason: Why that is the mode, or what else motion control notes.
        time: Of the robot's clock [s], or None.
        recording: File that is being written, "" while none is, None where no recorder runs.
        experiment: How far the identification experiment has come, or None.
        state: Of the worst node, as in `NodeLine`.
        sum: What matters most about all nodes, in words.
        nodes: In the order of the data flow.
        said: What nodes have complained of, the newest first.
        outcomes: What came of this menu's wishes, the newest first.
    """

    robot: str = ""
    missing: str = ""
    stop: str = ""
    command: UserCommand | None = None
    game: str = ""
    doing: str = ""
    mode: str = ""
    reason: str = ""
    time: float | None = None
    recording: str | None = None
    experiment: Progress | None = None
    state: str = "ok"
    sum: str = ""
    nodes: tuple[NodeLine, ...] = ()
    said: tuple[Said, ...] = ()
    outcomes: tuple[Outcome, ...] = ()


class Robot(Protocol):
    """What the menu steers. Nothing here waits; what came of a wish is in a later sight."""

    def look(self) -> Sight:
        """Return what there is to see now."""

    def emergency_stop(self, reason: str) -> None:
        """Stop the robot, whoever listens.

        Args:
            reason: In words.
        """

    def release(self) -> None:
        """Release the emergency stop."""

    def wish(self, wish: Wish) -> None:
        """Tell user input."""

    def push(self, direction: str, size: float) -> None:
        """Push the simulated robot's trunk.

        Args:
            direction: One of `PUSHES`, as the robot sees it.
            size: Impulse [N s].
        """

    def record(self, begin: bool) -> None:
        """Begin or end a recording."""

    def identify(self, begin: bool) -> None:
        """Begin the identification experiment, or end it early."""
