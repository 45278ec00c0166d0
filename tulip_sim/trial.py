"""What happened in a trial, in numbers."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass

from tulip_description.planar import Pose2D, wrap_angle

NO_CAMERA = "made-up features in place of camera and vision"
"""Told with every figure that perception without pictures had a part in."""
PORTION = 0.15  # [m] the path is measured in pieces of this length: the trunk's sway at each step is no way


@dataclass(frozen=True)
class TrialSummary:
    """The end of a trial.

    Attributes:
        mode: "graph" or "lockstep", and what else is special.
        seed: Of the scenario and of all noise.
        outcome: As the referee says: goal, own goal, out, time, fallen; or "unfinished".
        time: Played until then [s].
        touches: How often the robot met the ball.
        falls: Of the robot.
        distance_walked: [m]
        localization_error: RMS of the estimated position against the truth [m].
        heading_error: RMS of the estimated heading [deg].
        real_time_factor: Simulated time by wall-clock time.
        recording: The MCAP file, or "".
    """

    mode: str
    seed: int
    outcome: str
    time: float
    touches: int
    falls: int
    distance_walked: float
    localization_error: float
    heading_error: float
    real_time_factor: float
    recording: str = ""

    @property
    def scored(self) -> bool:
        """Whether the robot scored."""
        return self.outcome == "goal"

    def as_dict(self) -> dict[str, object]:
        """Return everything for JSON; numbers that are not known are None."""
        values = {**asdict(self), "scored": self.scored}
        return {key: None if isinstance(value, float) and math.isnan(value) else value for key, value in values.items()}

    def lines(self) -> list[tuple[str, str]]:
        """Return names and values for people."""
        return [
            ("outcome", f"{self.outcome} after {self.time:.1f} s"),
            ("touches of the ball", f"{self.touches}"),
            ("falls", f"{self.falls}"),
            ("distance walked", f"{self.distance_walked:.1f} m"),
            ("localization error", f"{self.localization_error:.2f} m, {self.heading_error:.1f} deg (RMS)"),
            ("real-time factor", f"{self.real_time_factor:.2f}"),
            ("recording", self.recording or "none"),
        ]


class TrialObserver:
    """Compares estimates with the truth and measures the way. Stands outside the robot."""

    def __init__(self) -> None:
        self.distance = 0.0
        self._counted: Pose2D | None = None
        self._truth: Pose2D | None = None
        self._squares = [0.0, 0.0]
        self._samples = 0

    def see_truth(self, pose: Pose2D) -> None:
        """Take the true pose of base_footprint in map."""
        self._truth = pose
        if self._counted is None:
            self._counted = pose
        portion = math.hypot(pose.x - self._counted.x, pose.y - self._counted.y)
        if portion >= PORTION:
            self.distance += portion
            self._counted = pose

    def see_estimate(self, pose: Pose2D) -> None:
        """Take the estimate of the pose seen last."""
        if self._truth is None:
            return
        self._squares[0] += (pose.x - self._truth.x) ** 2 + (pose.y - self._truth.y) ** 2
        self._squares[1] += wrap_angle(pose.yaw - self._truth.yaw) ** 2
        self._samples += 1

    @property
    def localization_error(self) -> float:
        """RMS of the position error [m]; NaN before the first estimate."""
        return math.sqrt(self._squares[0] / self._samples) if self._samples else math.nan

    @property
    def heading_error(self) -> float:
        """RMS of the heading error [deg]; NaN before the first estimate."""
        return math.degrees(math.sqrt(self._squares[1] / self._samples)) if self._samples else math.nan
