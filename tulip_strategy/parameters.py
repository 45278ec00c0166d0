"""Every number of the strategy, with its unit and why it has this value."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

from tulip_motion.gaze import GazeParameters
from tulip_motion.parameters import MotionParameters

_SIGNED = frozenset({"ready_x", "ready_y", "ready_yaw", "dribble_lateral", "throw_target_x", "throw_target_y"})


@dataclass(frozen=True)
class StrategyParameters(GazeParameters):
    """Numbers of the strategy and its gaze. Distances to the ball run from base_footprint to the ball's centre."""

    # Walking: what is asked of the legs.
    forward_speed: float = 0.4  # [m/s] walks 60 s without a fall at this speed
    backward_speed: float = 0.2  # [m/s] as measured for the gait
    sideways_speed: float = 0.15  # [m/s] beyond this the heading drifts
    turning_speed: float = 0.8  # [rad/s] leaves a margin to the 1.0 rad/s that the gait can do
    forward_acceleration: float = 0.3  # [m/s^2] full speed within about three steps
    sideways_acceleration: float = 0.3  # [m/s^2]
    turning_acceleration: float = 1.5  # [rad/s^2]
    position_gain: float = 0.9  # [1/s] speed per distance left; with 0.3 s of lag of the legs it does not overshoot
    heading_gain: float = 1.2  # [1/s] turning rate per heading error

    # Way round the ball.
    ball_clearance: float = 0.50  # [m] reach of a toe's corner (0.30) + ball (0.094) + error of the ball's place
    standoff: float = 0.58  # [m] behind the ball, where the approach ends: just outside the clearance
    arc_ahead: float = 0.6  # [rad] how far ahead on the circle round the ball the robot aims
    face_travel_distance: float = 0.8  # [m] with more left to go it faces its way, since forward is the fastest
    opponent_clearance: float = 0.7  # [m] half a keeper (0.25), the own half width (0.3), a margin

    upright_clearance: float = 0.5  # [m] the same for a goal post or a pole

    # Other robots, posts and poles.
    keep_off: float = 0.7  # [m] between the middles of two robots, at which none walks towards the other any more
    keep_off_upright: float = 0.4  # [m] the same for a goal post or a pole: the reach of a toe's corner (0.3), a margin
    keep_off_gain: float = 0.8  # [1/s] speed towards something per distance that is left
    kick_clear_distance: float = 0.72  # [m] nobody nearer in a kick's direction: the toe swings 0.5 m ahead
    kick_clear_angle: float = math.radians(50.0)  # [rad] to either side

    # Standing behind the ball: begin inside the first, end outside the second of each pair.
    behind_offset: float = 0.12  # [m] sideways, on the ball
    behind_offset_end: float = 0.25  # [m]
    behind_cone: float = 0.15  # [rad] more offset the farther the ball is away
    behind_cone_end: float = 0.35  # [rad]
    behind_heading: float = 0.35  # [rad] error of the robot's heading
    behind_heading_end: float = 0.8  # [rad]
    behind_reach: float = 1.0  # [m] ball no farther ahead than this
    behind_reach_end: float = 1.8  # [m] a dribbled ball rolls half a metre to a metre
    behind_nearest: float = 0.18  # [m] nearer, the ball is beside or under the robot: come round again

    # Dribbling.
    dribble_speed: float = 0.25  # [m/s] ball stays within a metre
    dribble_chase_speed: float = 0.35  # [m/s] while the ball is out of reach
    dribble_contact: float = 0.48  # [m] toe (0.217) + ball (0.094) + a stride and the lag of the legs
    dribble_lateral: float = 0.0  # [m] where the ball shall lie, positive left; 0 is between the toes
    dribble_offset: float = 0.09  # [m] ball farther off is not touched but lined up first
    dribble_heading: float = 0.3  # [rad] same, for the heading
    near_gain: float = 1.3  # [1/s] speed per offset next to the ball; a drifting gait leaves drift / gain of error

    # Kicking.
    kick_ahead: float = 0.34  # [m] ball's centre at the kick: toe (0.217) + ball (0.094) + 30 mm not to touch it
    kick_lateral: float = 0.5 * MotionParameters.stance_width  # [m] of the kicking foot's middle as the robot stands
    kick_ahead_window: float = 0.03  # [m] aligned within this, stepping
    kick_lateral_window: float = 0.03  # [m]
    kick_heading_window: float = 0.15  # [rad] the foot's direction makes up for the rest
    kick_gap_share: float = 0.3  # of the free gap: near the goal the gap is wide, and the heading may err as much
    kick_window_growth: float = 1.6  # windows grow to this times their size while lining up takes long
    kick_patience: float = 10.0  # [s] of lining up that double the windows
    kick_settle_growth: float = 1.9  # windows are this much wider once standing, so that it does not chatter
    kick_wait_ahead: float = 0.47  # [m] distance kept from the ball until the robot is lined up sideways
    kick_approach_gain: float = 0.6  # [1/s] speed per distance before that; higher, the legs overshoot into the ball
    kick_align_speed: float = 0.12  # [m/s] small steps next to the ball
    kick_settle_time: float = 0.4  # [s] stand this long: the last step and the ball's estimate die down
    kick_settle_limit: float = 2.5  # [s] stop waiting for motion control to report that it stands
    kick_start_limit: float = 3.0  # [s] no kick has begun by then: it was refused
    kick_run_limit: float = 8.0  # [s] a kick lasts about 3 s; longer means that its end was not reported
    kick_speed: float = 3.0  # [m/s] wanted of the ball
    kick_least_speed: float = 1.0  # [m/s] of a pass; a slower foot moves the ball by chance
    kick_direction_limit: float = 0.2  # [rad] farther sideways the foot cannot swing
    kick_outward_slope: float = 3.0  # [rad/m] less of it outwards where the other foot stands in the way of the run-up
    kick_range: float = 3.5  # [m] ball to goal; farther, 5 deg of error miss the gap
    kick_range_end: float = 4.0  # [m] keeps a begun alignment when the estimate jumps
    kick_gap: float = 0.22  # [rad] free angle wanted: twice the kick's spread to each side
    kick_gap_end: float = 0.15  # [rad]
    kick_always_range: float = 1.3  # [m] so near that waiting for a wider gap would run into the keeper

    # Aim.
    opponent_radius: float = 0.30  # [m] keeper's half width and a step to the side
    opponent_reach: float = 0.087  # an opponent covers so much more to each side per metre from the ball: 0.6 of what a
    # keeper at 0.2 m/s can step while a ball rolls at 1.4 m/s; all of it would close gaps that are worth a shot
    stuck_distance: float = 0.9  # [m] a ball this near an opponent that leaves no gap is passed sideways
    stuck_turn: float = math.radians(100.0)  # [rad] off the direction to that opponent
    stuck_pass: float = 1.2  # [m]
    aim_time: float = 2.0  # [s] smoothing of the aim point: estimates of keeper and pose jitter
    aim_jump: float = 2.0  # [m] of the aim point in odom: localization found its place anew, so it is taken at once
    gap_preference: float = 1.25  # another gap has to be this much wider to change the side

    # Looking at the keeper that one shoots past.
    keeper_glance_ball: float = 1.5  # [m] with the ball nearer than this
    keeper_glance_range: float = 5.0  # [m] and no farther than this from the goal
    keeper_glance_age: float = 1.0  # [s] a keeper unseen for so long may have moved by the goal's free part
    keeper_glance_time: float = 0.8  # [s] of looking: way of the head, and three or four pictures
    keeper_glance_pause: float = 2.5  # [s] for the ball in between

    # Ball lost and found.
    ball_lost_age: float = 5.0  # [s] unseen: a resting ball stays where it was while the way round turns the back on it
    ball_found_age: float = 0.5  # [s] seen again
    blind_age: float = 2.0  # [s] of the newest picture, after which the robot stands until it sees again
    ball_gone_time: float = 1.0  # [s] without any estimate: bridges one that is dropped and made again
    ball_confidence: float = 0.25  # below this it may be a false sighting
    look_back_time: float = 1.5  # [s] look where it was
    look_back_reach: float = 1.2  # [rad] where it was farther to the side, the body turns there too
    sweep_time: float = 9.0  # [s] one whole sweep of the head, far and near, lasts 8.6 s
    search_turn_speed: float = 0.5  # [rad/s] slow enough for a picture every 2 deg
    search_walk_time: float = 6.0  # [s] towards the field's middle after a whole turn without a ball

    # Goalkeeper.
    keeper_out: float = 0.95  # [m] before the goal line: as far as the goal area reaches; it hides more of the goal
    keeper_nearest: float = 0.5  # [m] to a ball before the robot; nearer, it stands half-way between ball and goal
    keeper_place_tolerance: float = 0.08  # [m] and [rad]
    keeper_alert: float = 4.0  # [m] a ball nearer than this may be shot: steps on the spot, to be quick
    keeper_shot_speed: float = 0.5  # [m/s] a ball that rolls towards the goal as fast as this is a shot
    keeper_shot_over: float = 0.15  # [m/s] slower, it is none any more
    keeper_side_speed: float = 0.3  # [m/s] asked of the legs, which give what they can
    keeper_cover: float = 0.08  # [m] to each side of the middle, where the feet stop a ball without a step
    keeper_full_speed_offset: float = 0.1  # [m] beyond that from which it steps as fast as it can
    keeper_toes: float = 0.1  # [m] before base_footprint, where the feet meet a ball
    keeper_roll_margin: float = 0.3  # [m] a ball may roll farther than expected
    keeper_beside: float = 0.4  # [m] beside a post, where a shot may go in after all
    keeper_still_speed: float = 0.25  # [m/s] a slower ball may be cleared
    keeper_clear_depth: float = 1.6  # [m] from the goal line, the ball is the keeper's
    keeper_clear_margin: float = 0.4  # [m] farther once it goes for it
    keeper_clear_reach: float = 4.0  # [m] how far away the point lies that a cleared ball is sent to

    # Technical challenges.
    throw_target_x: float = 0.0  # [m] in map, where a ball thrown in shall come to rest
    throw_target_y: float = 0.0  # [m]
    course_clearance: float = 0.75  # [m] of the dribbled ball from an obstacle's middle: room for the robot behind

    # Game.
    walk_to_ready: bool = False  # in dribble and kick the robot is placed by hand
    ready_x: float = -1.5  # [m] in map
    ready_y: float = 0.0  # [m] in map
    ready_yaw: float = 0.0  # [rad] in map
    place_tolerance: float = 0.15  # [m] of walking to a place

    def __post_init__(self) -> None:
        super().__post_init__()
        for field in fields(self):
            value = getattr(self, field.name)
            if not isinstance(value, float):
                continue
            if not math.isfinite(value):
                raise ValueError(f"{field.name} is {value}; expected a finite number")
            if field.name not in _SIGNED and value <= 0.0:
                raise ValueError(f"{field.name} is {value}; expected > 0")
        if self.arc_ahead >= 1.2:
            raise ValueError(f"arc_ahead is {self.arc_ahead} rad; expected less than 1.2")
        for less, more in (
            ("behind_offset", "behind_offset_end"),
            ("behind_cone", "behind_cone_end"),
            ("behind_heading", "behind_heading_end"),
            ("behind_reach", "behind_reach_end"),
            ("behind_nearest", "kick_ahead"),
            ("kick_ahead", "kick_wait_ahead"),
            ("kick_wait_ahead", "standoff"),
            ("ball_clearance", "standoff"),
            ("standoff", "behind_reach"),
            ("kick_range", "kick_range_end"),
            ("kick_gap_end", "kick_gap"),
            ("kick_least_speed", "kick_speed"),
            ("kick_window_growth", "kick_settle_growth"),
            ("ball_found_age", "ball_lost_age"),
        ):
            if getattr(self, less) >= getattr(self, more):
                raise ValueError(
                    f"{less} is {getattr(self, less)}; expected less than {more}, which is {getattr(self, more)}"
                )
