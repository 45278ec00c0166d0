"""The camera's pose at the moment of a picture, from body and head readings around it."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation, Slerp

Array = NDArray[np.float64]

CameraPose = Callable[[float, Array, float, float], Array]
"""Base height [m], orientation of base_link in odom (x, y, z, w), pan and tilt [rad] -> (4, 4) transform of
camera_optical_frame in base_footprint."""


@dataclass(frozen=True)
class PoseBufferParameters:
    """How readings are kept and used.

    Attributes:
        kept: Readings older than this, counted from the newest, are forgotten [ns].
        largest_gap: Two readings further apart are not interpolated between [ns].
        extrapolation: The newest reading is used for pictures up to this much younger [ns].
        backward_jump: Readings that are older than the newest by more than this mean a restart: the buffer
            is emptied. Readings that are older by less came late and are dropped [ns].
    """

    kept: int = 1_000_000_000  # [ns] pictures wait far less than a second
    largest_gap: int = 100_000_000  # [ns] five odometry messages; a walking robot sways at about 1 Hz
    extrapolation: int = 0  # [ns] the next reading is at most 20 ms away: waiting is more exact than guessing
    backward_jump: int = 500_000_000

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        for name in ("kept", "largest_gap", "backward_jump"):
            if getattr(self, name) <= 0:
                raise ValueError(f"{name} is {getattr(self, name)} ns; expected > 0 ns")
        if self.extrapolation < 0:
            raise ValueError(f"extrapolation is {self.extrapolation} ns; expected >= 0 ns")


@dataclass(frozen=True)
class MissingPose:
    """Why there is no camera pose for a stamp.

    Attributes:
        reason: For a person to read.
        may_come: True if readings that arrive later can still help.
    """

    reason: str
    may_come: bool


@dataclass
class _Series:
    """Readings of one source in the order of their stamps."""

    name: str
    stamps: list[int] = field(default_factory=list)
    values: list[Any] = field(default_factory=list)

    def add(self, stamp: int, value: Any, parameters: PoseBufferParameters) -> None:
        if self.stamps and stamp <= self.stamps[-1]:
            if stamp > self.stamps[-1] - parameters.backward_jump:
                return
            self.stamps.clear()
            self.values.clear()
        self.stamps.append(stamp)
        self.values.append(value)
        first = bisect_left(self.stamps, stamp - parameters.kept)
        del self.stamps[:first], self.values[:first]

    def around(self, stamp: int, parameters: PoseBufferParameters) -> tuple[Any, Any, float] | MissingPose:
        """Return the readings before and after a stamp, and the share of the second, 0 to 1."""
        if not self.stamps:
            return MissingPose(f"no {self.name} has come yet", may_come=True)
        index = bisect_left(self.stamps, stamp)
        if index == len(self.stamps):
            late = stamp - self.stamps[-1]
            if late <= parameters.extrapolation:
                return self.values[-1], self.values[-1], 0.0
            return MissingPose(f"newest {self.name} is {late / 1e6:.0f} ms older", may_come=True)
        if self.stamps[index] == stamp:
            return self.values[index], self.values[index], 0.0
        if index == 0:
            early = self.stamps[0] - stamp
            return MissingPose(f"oldest {self.name} is {early / 1e6:.0f} ms younger", may_come=False)
        gap = self.stamps[index] - self.stamps[index - 1]
        if gap > parameters.largest_gap:
            return MissingPose(f"gap of {gap / 1e6:.0f} ms in {self.name}", may_come=False)
        return self.values[index - 1], self.values[index], (stamp - self.stamps[index - 1]) / gap


class PoseBuffer:
    """Keeps the last second of body and head readings and interpolates between them."""

    def __init__(self, parameters: PoseBufferParameters, camera_pose: CameraPose) -> None:
        """Make an empty buffer.

        Args:
            parameters: How readings are kept and used.
            camera_pose: The robot's forward kinematics up to the camera.
        """
        self._parameters = parameters
        self._camera_pose = camera_pose
        self._body = _Series("odometry")
        self._head = _Series("head joint state")

    def add_body(self, stamp: int, height: float, orientation: ArrayLike) -> None:
        """Add a reading of base_link in odom.

        Args:
            stamp: When it was measured [ns].
            height: z of base_link above the ground [m].
            orientation: (4,) quaternion x, y, z, w.

        Raises:
            ValueError: if a number is not finite or the quaternion has no direction.
        """
        quaternion = np.asarray(orientation, dtype=np.float64).reshape(-1)
        norm = float(np.linalg.norm(quaternion))
        if quaternion.shape != (4,) or not math.isfinite(norm) or norm < 1e-6 or not math.isfinite(height):
            raise ValueError(
                f"body reading is {height} m, {quaternion.tolist()}; expected a finite height and a quaternion (4,)"
            )
        self._body.add(stamp, (height, quaternion / norm), self._parameters)

    def add_head(self, stamp: int, pan: float, tilt: float) -> None:
        """Add a reading of the head joints [rad].

        Raises:
            ValueError: if an angle is not finite.
        """
        if not (math.isfinite(pan) and math.isfinite(tilt)):
            raise ValueError(f"head reading is {pan}, {tilt} rad; expected finite angles")
        self._head.add(stamp, (pan, tilt), self._parameters)

    def camera_in_footprint(self, stamp: int) -> Array | MissingPose:
        """Return the (4, 4) transform of camera_optical_frame in base_footprint at a stamp [ns], or why not."""
        body = self._body.around(stamp, self._parameters)
        if isinstance(body, MissingPose):
            return body
        head = self._head.around(stamp, self._parameters)
        if isinstance(head, MissingPose):
            return head
        (height_before, turn_before), (height_after, turn_after), share = body
        height = height_before + share * (height_after - height_before)
        turn = Slerp([0.0, 1.0], Rotation.from_quat(np.stack([turn_before, turn_after])))(share).as_quat()
        (pan_before, tilt_before), (pan_after, tilt_after), share = head
        pan = pan_before + share * (pan_after - pan_before)
        tilt = tilt_before + share * (tilt_after - tilt_before)
        return self._camera_pose(height, turn, pan, tilt)
