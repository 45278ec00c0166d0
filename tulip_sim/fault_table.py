"""Everything that can break, how that is made to happen, and what the robot then does: the table of docs/safety.md.

The bench `faults` makes each row happen in a graph while the robot walks, and compares what it then does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

BREAKS = 8.0  # [s] of simulated time when a fault of the simulator or of messages begins: the robot walks by then


class Reaction(Enum):
    """What a robot does about a fault."""

    GOES_ON = "goes on"
    STANDS = "stands still"
    LIMP = "is limp"


class Way(Enum):
    """How a signal makes a process ill."""

    STOPPED = "SIGSTOP"
    SLOW = "SIGSTOP for 60 ms, SIGCONT for 40 ms, and so on"
    STALLED = "SIGSTOP for 3 s"
    HUNG = "SIGSTOP, and nobody continues it"


@dataclass(frozen=True)
class Row:
    """One fault.

    Attributes:
        name: What is broken, in words.
        how: How it is made to happen.
        reaction: What the robot does while it lasts.
        because: Why, and what comes after.
        tells: Node, and part of what its diagnostics say meanwhile; ("", "") where nobody has to.
        node: Node that gets a signal, and `way` which; "" for none.
        way: See there.
        sensor: Fault of the simulated body, see tulip_sim/faults.py, without its time.
        disturbed: Topics whose messages suffer, and `disturbance` how.
        disturbance: Parameters of node disturber.
        free: The simulation does not wait for answers, but runs at a quarter of real time: only so can a message that
            steers the joints be too late.
        no_room: Node whose files cannot grow any more.
        seconds: Simulated time that is watched, from the fault on; from the new start of a node that hung.
    """

    name: str
    how: str
    reaction: Reaction
    because: str
    tells: tuple[str, str] = ("", "")
    node: str = ""
    way: Way | None = None
    sensor: str = ""
    disturbed: tuple[str, ...] = ()
    disturbance: Mapping[str, Any] = field(default_factory=dict)
    free: bool = False
    no_room: str = ""
    seconds: float = 8.0

    @property
    def at_any_time(self) -> bool:
        """Whether it needs no graph of its own: it is made to happen from outside, and ends."""
        return bool(self.node or self.no_room) and self.way is not Way.HUNG


GOES_ON, STANDS, LIMP = Reaction
JOINT_LOOP = ("joint_states", "imu", "foot_forces", "legs/joint_command")
OTHERS = ("features", "odometry", "world_state", "motion_state", "walk_command", "head_command", "head/joint_command")


def _stopped(
    node: str, reaction: Reaction, because: str, tells: tuple[str, str] = ("", ""), seconds: float = 8.0
) -> Row:
    return Row(
        f"{node} stopped", Way.STOPPED.value, reaction, because, tells, node=node, way=Way.STOPPED, seconds=seconds
    )


def _slow(node: str, because: str) -> Row:
    return Row(f"{node} slow", Way.SLOW.value, GOES_ON, because, node=node, way=Way.SLOW)


def _sensor(name: str, line: str, reaction: Reaction, because: str, tells: tuple[str, str]) -> Row:
    how = f"simulator, `world.faults: [{line} {BREAKS:g}]`"
    return Row(name, how, reaction, because, tells, sensor=line)


def _messages(name: str, topics: tuple[str, ...], reaction: Reaction, because: str, **disturbance: Any) -> Row:
    words = ", ".join(f"{key} {value}" for key, value in disturbance.items())
    how = f"node disturber: {words}"
    free = topics is JOINT_LOOP
    return Row(name, how, reaction, because, disturbed=topics, disturbance=disturbance, free=free)


AGAIN = "; after 10 s the launcher starts it again"
ROWS: tuple[Row, ...] = (
    _stopped(
        "vision", STANDS, "strategy does not walk when pictures stop for 2 s" + AGAIN, ("worldmodel", "no features")
    ),
    _stopped(
        "worldmodel",
        STANDS,
        "strategy is silent without it, and motion control stops walking after 0.5 s" + AGAIN,
        ("strategy", "no world_state"),
    ),
    _stopped(
        "head",
        GOES_ON,
        "the head hangs loose; the ball may be lost and searched for" + AGAIN,
        ("driver", "commands of the head outlived"),
    ),
    _stopped(
        "motion",
        LIMP,
        "the driver damps the legs after 0.04 s and lets go of them 0.5 s later" + AGAIN,
        ("driver", "commands of the legs outlived"),
        seconds=4.0,  # then people set it up
    ),
    _stopped(
        "strategy",
        STANDS,
        "motion control stops walking after 0.5 s without a command" + AGAIN,
        ("motion", "strategy is silent"),
    ),
    _stopped("game_input", GOES_ON, "the last word of the referee holds" + AGAIN),
    _stopped("user_input", GOES_ON, "the last wish of the user holds" + AGAIN),
    Row(
        "simulator stalled",
        Way.STALLED.value,
        GOES_ON,
        "time stands still for all, then goes on",
        ("motion", "time stands still"),
        node="driver",
        way=Way.STALLED,
    ),
    Row(
        "strategy hung",
        Way.HUNG.value,
        GOES_ON,
        "the launcher kills a node without a sign of life for 10 s while others have some, and starts it again",
        node="strategy",
        way=Way.HUNG,
    ),
    _slow("vision", "fewer pictures are looked at"),
    _slow("worldmodel", "it works on what it gets, and tells of messages left out"),
    _slow("strategy", "it decides more rarely"),
    _slow("motion", "the simulation waits for it; of a robot of metal the rows of late messages tell"),
    _messages(
        "a fifth of all sensor readings and leg commands lost",
        JOINT_LOOP,
        GOES_ON,
        "joints hold the command before",
        kind="lost",
        share=0.2,
    ),
    _messages(
        "sensor readings and leg commands late by 4 ms each",
        JOINT_LOOP,
        GOES_ON,
        "that is two ticks more in the loop",
        kind="late",
        hold=1,
    ),
    _messages(
        "sensor readings and leg commands late by 100 ms each",
        JOINT_LOOP,
        LIMP,
        "no gait balances with it: motion control sees the fall and lets go",
        kind="late",
        hold=25,
    ),
    _messages(
        "sensor readings and leg commands doubled",
        JOINT_LOOP,
        GOES_ON,
        "the second one is dropped by its stamp or number",
        kind="doubled",
        share=0.5,
    ),
    _messages(
        "sensor readings and leg commands out of order",
        JOINT_LOOP,
        GOES_ON,
        "what is overtaken is dropped",
        kind="out of order",
        share=0.2,
        hold=2,
    ),
    _messages(
        "a fifth of all other messages lost", OTHERS, GOES_ON, "each is replaced by the next", kind="lost", share=0.2
    ),
    _messages("all other messages late", OTHERS, GOES_ON, "stamps tell what they speak of", kind="late", hold=3),
    _messages("all other messages doubled", OTHERS, GOES_ON, "as above", kind="doubled", share=1.0),
    _messages(
        "all other messages out of order",
        OTHERS,
        GOES_ON,
        "none is overtaken by so much that time seems to begin anew",
        kind="out of order",
        share=0.2,
        hold=3,
    ),
    _sensor(
        "camera gone",
        "camera",
        STANDS,
        "strategy does not walk when pictures stop for 2 s",
        ("vision", "no camera/image_raw"),
    ),
    _sensor(
        "IMU frozen",
        "imu",
        LIMP,
        "no gait and no stop balances without it: of five robots that were told to stand none did",
        ("motion", "the IMU is frozen"),
    ),
    _sensor(
        "encoder of a knee stuck",
        "encoder left_knee",
        LIMP,
        "its own controller drives that joint astray",
        ("motion", "the encoder of left_knee sticks"),
    ),
    _sensor(
        "encoder of a hip stuck",
        "encoder right_hip_roll",
        LIMP,
        "as above",
        ("motion", "the encoder of right_hip_roll sticks"),
    ),
    _sensor(
        "encoder of the head stuck",
        "encoder head_pan",
        GOES_ON,
        "the head looks elsewhere than it thinks; the ball may be lost and searched for",
        ("", ""),
    ),
    _sensor(
        "force cell dead",
        "cell left_toe_outer",
        GOES_ON,
        "the other cells tell enough",
        ("motion", "force cell dead: left toe outer"),
    ),
    _messages(
        "clock jumps forward by 100 s",
        ("/clock",),
        GOES_ON,
        "nodes go by the stamps of messages, not by the clock",
        kind="none",
        clock_jump=100.0,
    ),
    _messages(
        "clock jumps back by 5 s",
        ("/clock",),
        GOES_ON,
        "as above; a node that hears nothing with a stamp begins anew",
        kind="none",
        clock_jump=-5.0,
    ),
    Row(
        "disk full",
        "RLIMIT_FSIZE of the recorder: its file cannot grow",
        GOES_ON,
        "the recording ends, and nothing else",
        ("recorder", "ended early"),
        no_room="recorder",
    ),
)
"""All rows but those of killed nodes, which the bench kills again and again."""


def markdown_table() -> str:
    """Return the table for docs/safety.md."""
    lines = ["| fault | made by | the robot | because | who tells |", "| --- | --- | --- | --- | --- |"]
    for row in ROWS:
        node, words = row.tells
        tells = f"`{node}`: ... {words} ..." if node else "-"
        lines.append(f"| {row.name} | {row.how} | **{row.reaction.value}** | {row.because} | {tells} |")
    return "\n".join(lines) + "\n"
