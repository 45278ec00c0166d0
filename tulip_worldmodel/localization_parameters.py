"""Parameters of localization."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tulip_description.positive import check_positive


@dataclass(frozen=True)
class LocalizationParameters:
    """Parameters of localization. Noise of dead reckoning grows with the root of what it is given for.

    What odometry says of its own uncertainty (slips, hops, falls) is added to the position noise given here.
    """

    start_position_spread: float = 0.3  # [m] a person puts the robot down by eye
    start_heading_spread: float = math.radians(10.0)  # [rad]
    position_noise_per_metre: float = 0.003  # [m/sqrt(m)] what odometry does not know of: carpet that gives way
    position_noise_per_radian: float = 0.003  # [m/sqrt(rad)] turning in place wanders
    position_noise_per_second: float = 0.001  # [m/sqrt(s)] keeps the filter awake while standing
    heading_noise_per_metre: float = math.radians(0.06)  # [rad/sqrt(m)]
    heading_noise_per_radian: float = math.radians(0.15)  # [rad/sqrt(rad)]
    heading_noise_per_second: float = math.radians(0.04)  # [rad/sqrt(s)] noise of the IMU's heading
    drift_spread: float = 0.0005  # [rad/s] of the heading: bias of the IMU, twice that of a good one
    drift_time: float = 60.0  # [s] how long a drift lasts
    noise_scale_rate: float = 0.01  # by which a feature changes the factor on vision's spreads: 4 s to the threefold
    greatest_noise_scale: float = 4.0  # vision is not taken to be worse than so many times what it says
    landmark_spread: float = 0.01  # [m] which edge of a line or post is seen; 0.03 on a field painted by hand
    systematic_spread: float = 0.003  # [m] of x and y, that no number of pictures removes: a mount that is 5 mm too low
    # or a field 0.4 % too long moves the pose by that share of the range, otherwise at each place
    longest_range: float = 8.0  # [m] features further away on the ground are not used
    shortest_line: float = 0.5  # [m] shorter pieces may belong to the centre circle
    false_rate_crossing: float = 0.15  # one in seven, measured
    false_rate_other: float = 0.05  # posts, poles, marks, lines
    gate_probability: float = 0.995  # share of true features inside the chi-square gate
    association_odds: float = 10.0  # the best explanation must be so much likelier than the next
    lost_time: float = 2.0  # [s] with features but none explained, after which uncertainty grows faster
    lost_position_noise: float = 0.3  # [m/sqrt(s)] then, and while being lost is all that is known
    lost_heading_noise: float = math.radians(10.0)  # [rad/sqrt(s)] then
    explained_rate: float = 0.9  # share of features that find a landmark while the pose is right
    chance_rate: float = 0.35  # share that finds one by chance while it is wrong
    lost_evidence: float = (
        8.0  # nats of Page's test that say "lost": about one false alarm in 3000 independent pictures
    )
    usual_evidence: float = 0.35  # nats a picture takes off: unexplained are 0.15 where right, 0.5 where wrong
    most_evidence: float = 1.0  # nats that one picture can add: what it shows wrongly, the next one shows, too
    seed_share: float = 0.1  # of all weight, that goes to new hypotheses at each picture while lost
    seeds: int = 8  # new hypotheses a picture at most
    most_hypotheses: int = 16  # kept; each costs about 1 ms a picture
    evidence_share: float = 0.2  # of a picture's log-likelihood that counts: successive ones err alike
    winning_weight: float = 0.97  # of a hypothesis that is believed alone again
    winning_pictures: int = 8  # in which it has found landmarks by then: half a second
    heading_continuity: float = math.radians(25.0)  # [rad] how well the IMU's heading survives what made the robot lost
    heading_break: float = 0.003  # probability density, relative to the peak, of a heading that the IMU missed

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is out of range.
        """
        check_positive(self)
        for name in (
            "false_rate_crossing",
            "false_rate_other",
            "gate_probability",
            "explained_rate",
            "chance_rate",
            "seed_share",
            "winning_weight",
        ):
            if getattr(self, name) >= 1.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected a probability < 1")
        if self.chance_rate >= self.explained_rate:
            raise ValueError(f"chance_rate is {self.chance_rate}; expected less than explained_rate")
        if self.greatest_noise_scale < 1.0:
            raise ValueError(f"greatest_noise_scale is {self.greatest_noise_scale}; expected >= 1")
        if self.association_odds <= 1.0:
            raise ValueError(f"association_odds is {self.association_odds}; expected > 1")
