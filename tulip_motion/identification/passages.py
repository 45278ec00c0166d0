"""The experiment as a row of passages: onto one foot, from posture to posture, back onto both feet; the other foot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import StrEnum

from tulip_description.positive import check_positive
from tulip_motion.identification.experiment_plan import FootPlan
from tulip_motion.identification.posture_roads import Road
from tulip_motion.interface import Side

QUINTIC_PEAK = 1.875  # greatest rate of a quintic by its mean
BOTH, ALONE = 0.5, 1.0  # shares of the weight on the stance foot


class Doing(StrEnum):
    """What the robot does in a passage."""

    STAND = "stand"
    SHIFT = "shift"
    UNLOAD = "unload"
    LIFT = "lift"
    MOVE = "move"
    HOLD = "hold"
    LOWER = "lower"
    RETURN = "return"
    LIMP = "limp"


@dataclass(frozen=True)
class Passage:
    """A stretch of the experiment.

    Attributes:
        doing: What it is.
        stance: The foot that carries more.
        road: Along which the joints move; None to stay.
        time: That takes [s]; the longest, for one that waits for something.
        shares: Of the weight on the stance foot, at its begin and end.
        posture: Number of the posture that it leads to or holds; -1 for none.
        way_back: Passages from its begin back to standing on both feet; none if it is a part of such a way itself.
    """

    doing: Doing
    stance: Side
    road: Road | None
    time: float
    shares: tuple[float, float] = (ALONE, ALONE)
    posture: int = -1
    way_back: tuple[Passage, ...] = ()


@dataclass(frozen=True)
class Pace:
    """How fast passages are."""

    joint_speed: float = 0.5  # [rad/s] of the fastest joint: slow enough to be nearly static
    least_time: float = 0.8  # [s] of a road
    shift_time: float = 2.5  # [s] from both feet onto one
    lift_time: float = 2.0  # [s]
    unload_patience: float = 8.0  # [s] for the CoP to come near its aim before the foot lifts
    hold_patience: float = 8.0  # [s] for the robot to become still; a posture that takes longer is left out

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is not positive.
        """
        check_positive(self)


STANDING = Passage(Doing.STAND, Side.LEFT, None, 0.0, (BOTH, BOTH))


def passages(plans: Sequence[FootPlan], pace: Pace) -> Iterator[Passage]:
    """Yield the passages of a whole experiment, from standing on both feet to that again.

    Args:
        plans: One a stance foot.
        pace: How fast.
    """
    number = 0
    for plan in plans:
        yield from _on_one_foot(plan, pace, number)
        number += len(plan.visits)
    yield STANDING


def _on_one_foot(plan: FootPlan, pace: Pace, number: int) -> Iterator[Passage]:
    stance = Side.LEFT if plan.side == "left" else Side.RIGHT
    shift, lift = plan.weight_shift
    back = (
        Passage(Doing.LOWER, stance, lift.reversed(), pace.lift_time),
        Passage(Doing.RETURN, stance, shift.reversed(), pace.shift_time, (ALONE, BOTH)),
        STANDING,
    )

    def along(road: Road, posture: int = -1, way_back: tuple[Passage, ...] = ()) -> Passage:
        time = max(pace.least_time, road.length * QUINTIC_PEAK / pace.joint_speed)
        return Passage(Doing.MOVE, stance, road, time, posture=posture, way_back=way_back)

    yield Passage(Doing.SHIFT, stance, shift, pace.shift_time, (BOTH, ALONE), way_back=back[2:])
    yield Passage(Doing.UNLOAD, stance, None, pace.unload_patience, way_back=back[1:])
    yield Passage(Doing.LIFT, stance, lift, pace.lift_time, way_back=back[1:])
    way_back: tuple[Passage, ...] = back
    for visit in plan.visits:
        for road in visit.roads:
            yield along(road, number, way_back)
            way_back = (along(road.reversed()), *way_back)
        way_back = (*(along(road) for road in visit.home), *back)
        yield Passage(Doing.HOLD, stance, None, pace.hold_patience, posture=number, way_back=way_back)
        number += 1
    yield from way_back[:-1]
