"""How far the experiment has come, and which readings count: what a recording of one says besides the sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from tulip_description.model import Side
from tulip_motion.identification.passages import Doing


@dataclass(frozen=True)
class Hold:
    """When a posture was held and averaged.

    Attributes:
        posture: Its number in the plan, from 0.
        side: The stance foot.
        begin, end: Stamps of the first and last reading that count [ns].
    """

    posture: int
    side: Side
    begin: int
    end: int

    def __post_init__(self) -> None:
        """Check side and times.

        Raises:
            ValueError: if there is no such foot, or the end lies before the begin.
        """
        if self.side not in ("left", "right") or not 0 <= self.begin <= self.end:
            raise ValueError(
                f"posture {self.posture} was held on foot {self.side!r} from {self.begin} to {self.end} ns; expected"
                " left or right, and stamps in their order"
            )


@dataclass(frozen=True)
class Progress:
    """How far the experiment has come.

    Attributes:
        doing: At present.
        posture: Number of the posture that is next or held, from 0; -1 for none.
        postures: How many the plan has.
        held: How many were averaged.
        left_out: Numbers of those at which the robot did not become still.
        seconds_left: About [s].
        reason: Why it was aborted, or "".
        hold: The last that ended, or None.
        finished: Whether nothing is left to do.
    """

    doing: Doing
    posture: int
    postures: int
    held: int
    left_out: tuple[int, ...]
    seconds_left: float
    reason: str
    hold: Hold | None
    finished: bool

    def as_dict(self) -> dict[str, object]:
        """Return everything for JSON."""
        return {**asdict(self), "left_out": list(self.left_out), "seconds_left": round(self.seconds_left, 1)}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Progress:
        """Return what `as_dict` gave.

        Raises:
            ValueError: if something is missing, unknown or of the wrong kind.
        """
        try:
            hold = None if values["hold"] is None else Hold(**values["hold"])
            own = {"doing": Doing(values["doing"]), "left_out": tuple(values["left_out"]), "hold": hold}
            return cls(**{**values, **own})
        except (KeyError, TypeError) as error:
            raise ValueError(
                f"progress of the experiment is {dict(values)}; something is missing or unknown"
            ) from error
