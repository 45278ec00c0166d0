"""How often things happen, in graph and lockstep alike."""

from __future__ import annotations

TICK = 4  # [ms] one control tick
SLOW_TICKS = 5  # clock, odometry and head run at 50 Hz
DECISION_TICKS = 5  # world state and strategy run at 50 Hz
CAMERA_TICKS = 16  # 15.6 pictures a second
FEATURE_DELAY_TICKS = 12  # 48 ms from the shutter to the features
