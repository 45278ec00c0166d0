"""Parameters of motion control: every default stands here, once, or in gait.yaml if the gait tuner finds it."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import cosh

from tulip_motion.gait_file import GaitFile, GaitFileError
from tulip_motion.lipm import time_constant
from tulip_motion.parameter_ranges import check_numbers

CHOICES = {
    "gait": ("dcm", "paper"),
    "paper_swing": ("sat", "smooth"),
    "feedforward": ("full", "gravity", "none"),
    "weight_sharing": ("zmp", "distance"),
    "learning": ("none", "adaptive", "waveform"),
}
"""Values of the parameters that are words."""

_GAIT = GaitFile()
_tuned = _GAIT.value


@dataclass(frozen=True)
class MotionParameters:
    """Gait, balance and joint control of the legs.

    A default `_tuned(NAME)` is the value of NAME in gait.yaml, which the gait tuner writes. Six numbers a leg follow
    the order hip yaw, hip roll, hip pitch, knee, ankle pitch, ankle roll.
    """

    control_period: float = 0.004  # [s] one tick of the driver

    # Gait: "dcm" walks best, with feedback; "paper" is eqs. (3)-(4) in open loop
    gait: str = "dcm"
    com_height: float = _tuned("com_height")  # [m] above the ground; leaves the knees bent enough for long steps
    step_time: float = _tuned("step_time")  # [s] whole step in place: quick steps catch pushes
    step_time_growth: float = _tuned("step_time_growth")  # [s/(m/s)] longer steps need more time
    double_support_time: float = _tuned("double_support_time")  # [s] of it the ZMP moves to the new stance foot
    first_shift_time: float = _tuned("first_shift_time")  # [s] the ZMP moves over the first stance foot
    stop_shift_time: float = _tuned("stop_shift_time")  # [s] the ZMP moves back between the feet after the last step
    stance_width: float = _tuned("stance_width")  # [m] between the ankles; hips are 0.267 m apart
    stance_narrowing: float = _tuned("stance_narrowing")  # [m/(m/s)] wide feet hold pushes, narrow ones slip less
    swing_height: float = _tuned("swing_height")  # [m] clears 10 mm of turf and 20 mm of tracking error
    landing_speed: float = _tuned("landing_speed")  # [m/s] the foot goes on down when the ground comes late
    zmp_forward: float = _tuned("zmp_forward")  # [m] aim point of the ZMP ahead of the ankle: the middle of the sole
    zmp_inward: float = _tuned("zmp_inward")  # [m] aim point towards the other foot
    # Speeds that were walked without a fall at friction 0.6 to 1.0; the reach of a step limits them as well
    max_speed_forward: float = 0.65  # [m/s]
    max_speed_backward: float = 0.35  # [m/s]
    max_speed_sideways: float = 0.3  # [m/s]
    max_turn_rate: float = 1.3  # [rad/s]
    max_speed_change: float = 0.10  # [m/s] a step; larger jumps move the DCM reference too far
    max_turn_change: float = 0.4  # [rad/s] a step
    max_course_correction: float = 0.02  # [m] sideways a step, back to the line of the walk
    course_give_way: float = 0.15  # [m] beside its line a robot that was pushed takes a new one
    max_heading_correction: float = 0.2  # [rad] a step; a robot that was turned by force gives way
    closing_tolerance: float = 0.03  # [m] feet that stand side by side within this need no further step
    closing_tolerance_yaw: float = 0.1  # [rad]
    goal_tolerance: float = 0.015  # [m] a footstep goal is reached within this
    goal_tolerance_yaw: float = 0.05  # [rad]
    goal_holonomic_distance: float = 0.5  # [m] nearer, the robot goes sideways rather than turn to its goal
    min_foot_distance: float = 0.165  # [m] sideways between the ankles; soles are 0.15 m wide
    reach_share: float = 0.76  # of what straight legs and the hip yaw could reach; see reach.py
    contact_force: float = 40.0  # [N] on a sole means that it carries weight
    contact_phase: float = 0.6  # of the swing; earlier contacts are stubbed toes, not landings
    late_contact_time: float = 0.10  # [s] after the planned landing the step is taken as landed
    placement_freeze_time: float = _tuned("placement_freeze_time")  # [s] before landing; later, jerk has no bound
    placement_gain: float = _tuned("placement_gain")  # 1 puts the foot where the DCM will be
    ankle_share: float = _tuned("ankle_share")  # of the ZMP's range that a step may count on against a disturbance
    step_time_weight: float = _tuned("step_time_weight")  # [m^2/s^2] 0.1 s early or late costs 5 mm of DCM error
    step_place_weight: float = _tuned("step_place_weight")  # [1] against the DCM error squared
    max_step_extension: float = _tuned("max_step_extension")  # [s] a step may last longer than planned
    max_step_time_rate: float = _tuned("max_step_time_rate")  # [s/s] of the landing time
    outer_excess_weight: float = _tuned("outer_excess_weight")  # [1] DCM error beyond the landing foot, hard to catch
    max_swing_speed: float = _tuned("max_swing_speed")  # [m/s] of the foot

    # The paper's gait. Eq. (4) as printed is "sat" with both times 0: the foot rises at 4 m/s, and lands at 2 c'
    paper_step_time: float = 0.45  # [s]
    paper_swing: str = "sat"  # "sat": eq. (4), its speed limited by paper_lift_time; "smooth": quintics up and down
    paper_lift_time: float = 0.08  # [s] the foot takes to rise to swing_height, and to come down
    paper_settle_time: float = 0.1  # [s] from rest to the mirrored motion, and back; with 0 it falls after 10-25 s
    paper_zmp_inward: float = 0.03  # [m] pivot from the middle of the sole towards the other foot: it sways less
    paper_max_speed: float = 0.4  # [m/s] forward and backward; it also walked at 0.5
    paper_max_turn_rate: float = 0.4  # [rad/s] every foot lands turned by a whole step's turn: toes come together

    # Kick
    kick_shift_time: float = 0.8  # [s] the weight moves onto the stance foot
    kick_lift_time: float = 0.35  # [s] up and back
    kick_return_time: float = 0.45  # [s] from the follow-through to over its old place
    kick_lower_time: float = 0.30  # [s]
    kick_height: float = 0.06  # [m] of the sole: the toe meets the ball a little below its centre
    kick_backswing: float = 0.20  # [m] the foot's run-up to the ball
    kick_shortest_backswing: float = 0.14  # [m] where the other foot leaves no room for the whole one
    kick_follow_through: float = 0.20  # [m] the foot's way beyond the contact, to slow down
    kick_brake_time: float = 0.25  # [s] a kick that is cancelled stops its foot
    kick_gap: float = 0.03  # [m] between the face of the standing foot and the ball, where a kick expects it
    kick_reach_near: float = 0.06  # [m] the ball may lie nearer than expected
    kick_reach_far: float = 0.07  # [m] farther
    kick_reach_across: float = 0.06  # [m] to either side
    kick_leg_reach: float = 0.29  # [m] of the foot from below its hip, seen from above; it falls with 0.316
    kick_clearance: float = 0.01  # [m] between the feet, seen from above: a kicking foot is lower than a foot is high
    kick_torso_turn: float = 3.0  # [rad/m^2] by the area that the foot sweeps; at 0 the stance foot slips by 3 deg
    kick_slip_time: float = 0.012  # [s] smoothing of the stance foot's measured yaw
    kick_speed_ratio: float = 1.13  # ball's speed over the foot's, measured: 1.05 at 1 m/s, 1.16 at 3.6 m/s
    ball_radius: float = 0.0935  # [m] as in the field's file
    kick_zmp_inward: float = 0.01  # [m] aim point on the stance foot while kicking
    max_kick_speed: float = 3.5  # [m/s] of the ball, from torque and speed of the knee
    max_kick_direction: float = 0.4  # [rad] either side, from the reach of the hip roll
    side_kick_gap: float = 0.05  # [m] at most; less where the feet stand so wide that the leg would be too short
    side_kick_backswing: float = 0.12  # [m] longest run-up; the other foot leaves less room for most directions
    side_kick_shortest_backswing: float = 0.06  # [m]
    side_kick_follow_through: float = 0.12  # [m]
    side_kick_reach_near: float = 0.05  # [m] the ball may lie nearer than expected
    side_kick_reach_far: float = 0.05  # [m] farther
    side_kick_reach_across: float = 0.05  # [m] ahead or behind
    side_kick_speed_ratio: float = 1.18  # ball's speed over the foot's, measured
    max_side_kick_speed: float = 2.0  # [m/s] of the ball
    max_side_kick_direction: float = 0.4  # [rad] either side of straight to the left or right
    walking_kick_step_time: float = 0.45  # [s] of the step that kicks
    walking_kick_steps: int = 8  # of the walk within which the ball has to be reached
    walking_kick_contact: float = 0.6  # share of the swing at which the foot meets the ball
    walking_kick_run_up: float = 0.08  # [m] least way of the foot to the ball
    walking_kick_reach_back: float = -0.05  # [m] kicking foot ahead of the standing one at the contact, at least
    walking_kick_reach_ahead: float = 0.20  # [m] at most
    walking_kick_reach_side: float = 0.36  # [m] beside it, at most; at least min_foot_distance
    walking_kick_speed_ratio: float = 1.13  # ball's speed over the foot's, measured
    max_walking_kick_speed: float = 2.0  # [m/s] of the ball
    max_walking_kick_direction: float = 0.3  # [rad] of the foot against the standing one

    # Balance
    dcm_gain: float = _tuned("dcm_gain")  # k in zmp = ref + (1 + k) (dcm - ref)
    zmp_limit_heel: float = 0.08  # [m] behind the aim point
    zmp_limit_toe: float = 0.09  # [m] ahead of the aim point
    zmp_limit_side: float = _tuned("zmp_limit_side")  # [m] either side of the aim point
    cmp_beyond_sole: float = _tuned("cmp_beyond_sole")  # [m] of the CMP beyond these limits, by a torso that turns
    torso_inertia: float = 0.85  # [kg m^2] moment about the CoM by the torso's angular acceleration, feet at rest
    max_lean: float = _tuned("max_lean")  # [rad] of the torso, for balance
    observer_position_gain: float = _tuned("observer_position_gain")  # [1/s]
    observer_twist_share: float = 0.5  # of a sole's twist, in the body's velocity; all of it keeps feet twisting
    imu_bias_time: float = 2.0  # [s] of single support, after which 63 % of the IMU's tilt error is known
    imu_bias_limit: float = 0.01  # [rad] more is no mounting error but ground that is not level
    observer_velocity_gain: float = _tuned("observer_velocity_gain")  # [1/s]
    height_stiffness: float = _tuned("height_stiffness")  # [1/s^2]
    height_damping: float = _tuned("height_damping")  # [1/s]
    torso_stiffness: float = _tuned("torso_stiffness")  # [1/s^2] IMU attitude to torso angular acceleration
    torso_damping: float = _tuned("torso_damping")  # [1/s]

    # Inverse kinematics, eq. (10)
    clik_gain_position: float = 20.0  # [1/s] K_p
    clik_gain_orientation: float = 20.0  # [1/s] K_o

    # Model of gait and feedforward: masses, CoMs and inertias of an identification instead of the robot file's
    body_file: str = ""  # as scripts/identify.py writes it; "" for robot.yaml

    # Feedforward, eq. (14): "full", or "gravity" as in 2012, at rest without acceleration, or "none"
    feedforward: str = "full"
    # Eq. (15): "zmp" shares the weight by the commanded ZMP about the common centre of pressure;
    # "distance" is the printed form, alpha from the CoM's distances to the feet, with which the robot does not walk
    weight_sharing: str = "zmp"

    # Joint control, eq. (13)
    stance_stiffness: tuple[float, ...] = (150.0, 400.0, 400.0, 400.0, 200.0, 200.0)  # [N m/rad]
    stance_damping: tuple[float, ...] = (3.0, 8.0, 8.0, 8.0, 2.0, 0.4)  # [N m s/rad]
    swing_stiffness: tuple[float, ...] = (150.0, 300.0, 300.0, 300.0, 60.0, 20.0)  # [N m/rad]
    swing_damping: tuple[float, ...] = (2.0, 6.0, 6.0, 5.0, 0.6, 0.15)  # [N m s/rad]; Kd dt / I must stay < 2
    # The open-loop gait has the joints alone to hold it
    open_stance_stiffness: tuple[float, ...] = (300.0, 1000.0, 1000.0, 1000.0, 600.0, 300.0)  # [N m/rad]
    open_stance_damping: tuple[float, ...] = (5.0, 15.0, 15.0, 12.0, 2.0, 0.4)  # [N m s/rad]
    open_swing_stiffness: tuple[float, ...] = (200.0, 500.0, 500.0, 400.0, 80.0, 20.0)  # [N m/rad]
    open_swing_damping: tuple[float, ...] = (2.0, 7.0, 7.0, 6.0, 0.6, 0.15)  # [N m s/rad]
    limp_damping: tuple[float, ...] = (2.0, 4.0, 4.0, 4.0, 0.6, 0.15)  # [N m s/rad] lets the robot sink, not drop

    # Iterative learning over steps, eqs. (16)-(18)
    learning: str = "none"  # "none", "adaptive" (the paper's law) or "waveform" (a torque over the step)
    # Read at the start if it exists, written when the robot stops walking: an .npz file, or a folder with one for each
    # robot and gait; "" keeps nothing.
    learning_file: str = ""
    learning_bound: float = 0.15  # share of a joint's torque limit that learning may use
    learning_margin: float = 1.2  # joint error by that without learning: above it learning does harm
    learning_patience: int = 3  # steps running on one foot above the margin, then it switches itself off
    learning_top_speed: float = 0.45  # [m/s] forward or back; faster, toes scuff, and learning feeds on it
    learning_delay: float = 0.001  # [s] joint angles are that old when they are read: the middle of 0-2 ms
    learning_gain: float = 0.5  # waveform: share of a step's feedback torque that the next steps add in advance
    learning_mirror_share: float = 0.7  # waveform: of the gain, for the other side; below 1, since legs differ
    learning_lead: float = 0.016  # [s] waveform: torque to effect; two ticks are delay, two the joint's lag
    learning_smoothing: float = 0.008  # [s] waveform: standard deviation of Q, which halves 23 Hz
    learning_beta: float = 10.0  # [s/rad] adaptive: tanh(beta e') for the sign of e'; velocity noise is 0.02 rad/s
    learning_gamma_rate: float = 50.0  # [s^2/rad^2] adaptive: Gamma_11 by K_D
    learning_gamma_cross: float = 0.0  # [s/rad] adaptive: Gamma_12 = Gamma_21 by K_D
    learning_gamma_sign: float = 1.0  # adaptive: Gamma_22 by K_D
    learning_leak: float = 0.02  # adaptive: share of theta forgotten each step
    learning_damping_bound: float = 2.0  # adaptive: theta_1 + beta theta_2 at most, by K_D

    # Odometry: standard deviations of its errors, from walks whose true way was measured from outside; a robot of metal
    # needs such walks too: the heading over minutes of standing, the feet's places over some ten steps of each kind
    odometry_yaw_drift: float = 0.0003  # [rad/s] of the IMU's heading, constant in a run; least squares over 40 s each
    odometry_yaw_walk: float = 0.0001  # [rad/sqrt(s)] what a constant drift leaves over; none was found, so the bound
    odometry_yaw_noise: float = 0.001  # [rad] of one heading, white: its spread while standing
    odometry_tilt_noise: float = 0.001  # [rad] of roll and pitch, white: their spread while standing
    odometry_tilt_bias: float = 0.003  # [rad] of roll and pitch, until it is learned: spread over robots
    # Slip by maximum likelihood over 4500 steps of 18 walks at friction 0.6 to 1.0, without the first 12 s, while the
    # IMU's tilt is learned. A share of the way, of the turn, or a scale constant in a walk made them no likelier
    odometry_step_noise: float = 0.00015  # [m] a step: what the IMU's yaw noise makes of the way between the feet
    odometry_twist_slip_along: float = 0.012  # [m/rad] along the foot, left of the shift of a sole that twists
    odometry_twist_slip_across: float = 0.024  # [m/rad] across it; the shift itself is 0.1 to 0.17 m/rad
    odometry_flight_slip: float = 0.5  # [m/s] while the feet carry nothing; few do: a hop of 0.024 s slid by 18 mm
    odometry_height_noise: float = 0.0003  # [m] of base_link; 0.0002 was found, 0.0004 beside a hop
    odometry_velocity_noise: float = 0.016  # [m/s] of base_link, horizontal, as found; soles that twist add tails
    odometry_climb_noise: float = 0.011  # [m/s] of base_link, vertical, as found; 0.003 but for landings
    odometry_rate_noise: float = 0.0055  # [rad/s] of the gyro, noise and bias, as found
    odometry_fall_spread: float = 0.7  # [m] a fallen robot is set up where it lies: about its own CoM height away

    # Falling
    fall_tilt: float = 0.7  # [rad] of the torso, after fall_horizon: no step can save the robot; 0.27 was survived
    fall_horizon: float = 0.2  # [s] that the tilt is predicted by; longer, and a hard foot strike looks like a fall
    fall_lean: float = 0.35  # [rad] after fall_horizon: with a DCM out of reach it is enough
    fall_reach_forward: float = 0.45  # [m] of the DCM from the feet: a stride of 0.36 m and the toe
    fall_reach_side: float = 0.475  # [m] a step of 0.42 m sideways and the edge of the sole
    fall_confirm_time: float = 0.02  # [s] a sign has to last; impacts ring for less
    upright_tilt: float = 0.25  # [rad] below it, now and after fall_horizon, a limp robot may stand up again
    # Broken sensors, which it goes limp for; see sensor_check.py
    encoder_check_limit: float = 0.1  # [rad] that a motor turns while its joint's angle is read the same
    imu_check_time: float = 0.04  # [s] of the same reading; even an IMU of 50 Hz has two different ones in it
    cell_check_time: float = (
        2.0  # [s] of readings of nothing while the foot carries the robot; it walks on all the same
    )
    upright_height: float = 0.9  # [m] of base_link above the soles; from lower down a robot that fell does not get up

    def __post_init__(self) -> None:
        check_numbers(vars(self))
        for name in ("step_time", "walking_kick_step_time"):
            if self.double_support_time >= getattr(self, name):
                raise ValueError(
                    f"double_support_time is {self.double_support_time} s; expected less than {name},"
                    f" {getattr(self, name)} s"
                )
        for name, choices in CHOICES.items():
            if getattr(self, name) not in choices:
                raise ValueError(f"{name} is {getattr(self, name)!r}; expected {' or '.join(choices)}")
        for name in ("paper_lift_time", "paper_settle_time"):
            value = getattr(self, name)
            if 2.0 * value > self.paper_step_time:
                raise ValueError(
                    f"{name} is {value} s; expected 0 to half of paper_step_time, {self.paper_step_time} s"
                )
        if self.paper_swing == "smooth" and self.paper_lift_time == 0.0:
            raise ValueError("paper_lift_time is 0 s; expected > 0 with paper_swing smooth")
        if self.gait == "paper":
            # The swing foot mirrors the CoM, which comes near the stance foot in the middle of the step.
            pivots = self.stance_width - 2.0 * self.paper_zmp_inward
            near = self.stance_width - pivots * (
                1.0 - 1.0 / cosh(0.5 * self.paper_step_time / time_constant(self.com_height))
            )
            if near < self.min_foot_distance:
                raise ValueError(
                    f"paper_step_time {self.paper_step_time} s brings the feet of gait paper to {near:.3f} m,"
                    f" closer than min_foot_distance, {self.min_foot_distance} m"
                )
        self._check_learning()
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, tuple) and len(value) != 6:
                raise ValueError(f"{field.name} is {value}; expected six numbers, hip yaw to ankle roll")

    def _check_learning(self) -> None:
        """Check what learning takes, beyond the ranges of single numbers."""
        for name, low, high in (
            ("learning_bound", 0.0, 1.0),
            ("learning_gain", 0.0, 1.0),
            ("learning_mirror_share", 0.0, 1.0),
            ("learning_lead", 0.0, self.step_time),
            ("learning_smoothing", 0.0, self.step_time / 6.0),
            ("learning_delay", 0.0, 0.1),
            ("learning_leak", 0.0, 1.0),
            ("learning_damping_bound", 0.0, 10.0),
        ):
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name} is {getattr(self, name)}; expected {low:g} to {high:g}")
        if self.learning_margin <= 1.0:
            raise ValueError(f"learning_margin is {self.learning_margin}; expected > 1")
        gamma = (self.learning_gamma_rate, self.learning_gamma_sign, self.learning_gamma_cross)
        if gamma[0] * gamma[1] < gamma[2] ** 2:
            raise ValueError(f"learning_gamma_rate, _sign, _cross are {gamma}; expected a positive semidefinite Gamma")


_GAIT.check_complete()
try:
    MotionParameters()
except ValueError as error:
    raise GaitFileError(f"{_GAIT.path}: {error}") from error
