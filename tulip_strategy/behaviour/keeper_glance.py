"""When to look up from the ball at the keeper, and where."""

from __future__ import annotations

from collections.abc import Sequence

from tulip_description.field import Field
from tulip_description.planar import Pose2D
from tulip_strategy.parameters import StrategyParameters
from tulip_worldmodel.world_state import ObjectEstimate

MIDDLE = 0.6  # [m] above the ground: feet and marker of a keeper are both in the picture then
BEFORE = 2.0  # [m] before the goal line, where an opponent is its keeper


class KeeperGlance:
    """Looks at the keeper of the other goal for a moment, then leaves the head to the ball for a while."""

    def __init__(self, parameters: StrategyParameters, field: Field) -> None:
        self._parameters = parameters
        self._goal = field.opponent_goal
        self._begun: int | None = None  # stamp of the present or last glance [ns]

    def point(
        self, stamp: int, robot: Pose2D, opponents: Sequence[ObjectEstimate]
    ) -> tuple[float, float, float] | None:
        """Return the point to look at now, in base_footprint [m], or None.

        Args:
            stamp: Now [ns].
            robot: Its pose in map.
            opponents: All that are known.
        """
        p, goal = self._parameters, self._goal
        keepers = [each for each in opponents if abs(goal.x - each.position_in_map[0]) < BEFORE]
        keeper = min(keepers, key=lambda each: abs(each.position_in_map[1]), default=None)
        elapsed = float("inf") if self._begun is None else (stamp - self._begun) * 1e-9
        if not 0.0 <= elapsed < p.keeper_glance_time:
            known = keeper is not None and keeper.age < p.keeper_glance_age
            if known or 0.0 <= elapsed < p.keeper_glance_time + p.keeper_glance_pause:
                return None
            self._begun = stamp
        if keeper is not None:
            return float(keeper.position[0]), float(keeper.position[1]), MIDDLE
        return (*robot.inverse().transform((goal.x, 0.0)), MIDDLE)
