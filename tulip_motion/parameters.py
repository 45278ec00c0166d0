"""Parameters of motion control: every default stands here, once, or in gait.yaml if the gait tuner finds it."""

from __future__ import annotations

from dataclasses import dataclass, fields

from tulip_motion.gait_file import GaitFile

_GAIT = GaitFile()
_tuned = _GAIT.value


@dataclass(frozen=True)
class MotionParameters:
    """Gait, balance and joint control of the legs.

    Six numbers a leg follow the order hip yaw, hip roll, hip pitch, knee, ankle pitch, ankle roll.
    """

    control_period: float = 0.004  # [s] one tick of the driver

    # Gait
    com_height: float = _tuned("com_height")  # [m] above the ground; leaves the knees bent enough for long steps
    step_time: float = _tuned("step_time")  # [s] whole step, double support included
    double_support_time: float = _tuned("double_support_time")  # [s] of it the ZMP moves to the new stance foot
    first_shift_time: float = _tuned("first_shift_time")  # [s] the ZMP moves over the first stance foot
    stop_shift_time: float = _tuned("stop_shift_time")  # [s] the ZMP moves back between the feet after the last step
    stance_width: float = _tuned("stance_width")  # [m] between the ankles; hips are 0.267 m apart
    swing_height: float = _tuned("swing_height")  # [m] clears 10 mm of turf and 20 mm of tracking error
    landing_speed: float = _tuned("landing_speed")  # [m/s] the foot goes on down when the ground comes late
    zmp_forward: float = _tuned("zmp_forward")  # [m] aim point of the ZMP ahead of the ankle: the middle of the sole
    zmp_inward: float = _tuned("zmp_inward")  # [m] aim point towards the other foot
    max_speed_forward: float = 0.6  # [m/s]
    max_speed_backward: float = 0.25  # [m/s]
    max_speed_sideways: float = 0.2  # [m/s]
    max_turn_rate: float = 1.0  # [rad/s]
    max_speed_change: float = 0.10  # [m/s] a step; larger jumps move the DCM reference too far
    max_turn_change: float = 0.4  # [rad/s] a step
    max_heading_correction: float = 0.2  # [rad] a step; a robot that was turned by force gives way
    min_foot_distance: float = 0.165  # [m] sideways between the ankles; soles are 0.15 m wide
    max_foot_distance: float = 0.42  # [m] sideways between the ankles, from the reach of the hip roll
    max_stride: float = 0.36  # [m] forward between the ankles, from the reach of the straight leg
    contact_force: float = 40.0  # [N] on a sole means that it carries weight
    contact_phase: float = 0.6  # of the swing; earlier contacts are stubbed toes, not landings
    late_contact_time: float = 0.10  # [s] after the planned landing the step is taken as landed
    placement_freeze_time: float = _tuned(
        "placement_freeze_time"
    )  # [s] before landing; later changes ask for endless jerk
    placement_gain: float = _tuned("placement_gain")  # 1 puts the foot where the DCM will be

    # Kick
    kick_shift_time: float = 0.8  # [s] the weight moves onto the stance foot
    kick_lift_time: float = 0.35  # [s] up and back
    kick_return_time: float = 0.45  # [s] from the follow-through to over its old place
    kick_lower_time: float = 0.30  # [s]
    kick_height: float = 0.06  # [m] of the sole: the toe meets the ball a little below its centre
    kick_backswing: float = 0.17  # [m] behind the standing place
    kick_follow_through: float = 0.23  # [m] ahead of it
    kick_zmp_inward: float = 0.01  # [m] aim point on the stance foot while kicking
    max_kick_speed: float = 3.5  # [m/s] of the foot, from the joint speed limits
    max_kick_direction: float = 0.5  # [rad] either side, from the reach of the hip roll

    # Balance
    dcm_gain: float = _tuned("dcm_gain")  # k in zmp = ref + (1 + k) (dcm - ref)
    zmp_limit_heel: float = 0.08  # [m] behind the aim point
    zmp_limit_toe: float = 0.09  # [m] ahead of the aim point
    zmp_limit_side: float = 0.055  # [m] either side of the aim point
    observer_position_gain: float = _tuned("observer_position_gain")  # [1/s]
    observer_velocity_gain: float = _tuned("observer_velocity_gain")  # [1/s]
    height_stiffness: float = _tuned("height_stiffness")  # [1/s^2]
    height_damping: float = _tuned("height_damping")  # [1/s]
    torso_stiffness: float = _tuned("torso_stiffness")  # [1/s^2] IMU attitude to torso angular acceleration
    torso_damping: float = _tuned("torso_damping")  # [1/s]

    # Inverse kinematics, eq. (10)
    clik_gain_position: float = 20.0  # [1/s] K_p
    clik_gain_orientation: float = 20.0  # [1/s] K_o
    clik_damping: float = 1e-6  # keeps the solve finite at the straight knee

    # Feedforward, eq. (15): "zmp" shares the weight by the commanded ZMP about the common centre of pressure;
    # "distance" is the printed form, alpha from the CoM's distances to the feet, with which the robot does not walk
    weight_sharing: str = "zmp"

    # Joint control, eq. (13)
    stance_stiffness: tuple[float, ...] = (150.0, 400.0, 400.0, 400.0, 200.0, 200.0)  # [N m/rad]
    stance_damping: tuple[float, ...] = (3.0, 8.0, 8.0, 8.0, 2.0, 0.4)  # [N m s/rad]
    swing_stiffness: tuple[float, ...] = (150.0, 300.0, 300.0, 300.0, 60.0, 20.0)  # [N m/rad]
    swing_damping: tuple[float, ...] = (2.0, 6.0, 6.0, 5.0, 0.6, 0.15)  # [N m s/rad]; Kd dt / I must stay < 2
    limp_damping: tuple[float, ...] = (2.0, 4.0, 4.0, 4.0, 0.6, 0.15)  # [N m s/rad] lets the robot sink, not drop

    # Odometry: standard deviations of its errors, from walks whose true way was measured from outside; a robot of metal
    # needs such walks too: the heading over minutes of standing, the feet's places over some ten steps of each kind
    odometry_yaw_drift: float = 0.0003  # [rad/s] of the IMU's heading, constant in a run; least squares over 40 s each
    odometry_yaw_walk: float = 0.0001  # [rad/sqrt(s)] what a constant drift leaves over; none was found, so the bound
    odometry_yaw_noise: float = 0.001  # [rad] of one heading, white: its spread while standing
    odometry_tilt_noise: float = 0.001  # [rad] of roll and pitch, white: their spread while standing
    odometry_tilt_bias: float = 0.003  # [rad] of roll and pitch, constant: spread of the mean over robots
    odometry_step_noise: float = 0.0003  # [m] a step; soles land within 0.1 mm of where the joints say
    odometry_forward_slip: float = 0.003  # share of the way; 0.001 was found on level carpet of friction 0.6 to 1.0
    odometry_sideways_slip: float = 0.006  # share of the way
    odometry_turn_slip: float = 0.001  # [m/rad] a sole that twists on the ground also shifts: 0.3 mm in 0.4 rad
    odometry_twist_slip: float = 0.05  # [m/rad] what is left of the shift of a twisting sole, of 0.17 m/rad itself
    odometry_height_noise: float = 0.0005  # [m] of base_link; 0.0004 was found
    odometry_velocity_noise: float = 0.014  # [m/s] of base_link, horizontal, as found
    odometry_climb_noise: float = 0.005  # [m/s] of base_link, vertical, as found
    odometry_rate_noise: float = 0.007  # [rad/s] of the gyro, noise and bias
    odometry_fall_spread: float = 0.7  # [m] a fallen robot is set up where it lies: about its own CoM height away

    # Falling
    fall_tilt: float = 0.7  # [rad] of the torso, after fall_horizon: no step can save the robot; 0.27 was survived
    fall_horizon: float = 0.2  # [s] that the tilt is predicted by; longer, and a hard foot strike looks like a fall
    fall_lean: float = 0.35  # [rad] after fall_horizon: with a DCM out of reach it is enough
    fall_reach_forward: float = 0.45  # [m] of the DCM from the feet: a stride of 0.36 m and the toe
    fall_reach_side: float = 0.475  # [m] a step of 0.42 m sideways and the edge of the sole
    fall_confirm_time: float = 0.02  # [s] a sign has to last; impacts ring for less
    upright_tilt: float = 0.25  # [rad] below it, now and after fall_horizon, a limp robot may stand up again
    upright_height: float = 0.9  # [m] of base_link above the soles; from lower down a robot that fell does not get up

    def __post_init__(self) -> None:
        for name in ("control_period", "com_height", "step_time", "double_support_time", "stance_width"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected > 0")
        if self.double_support_time >= self.step_time:
            raise ValueError(
                f"double_support_time is {self.double_support_time} s; expected less than step_time, {self.step_time} s"
            )
        if self.weight_sharing not in ("zmp", "distance"):
            raise ValueError(f"weight_sharing is {self.weight_sharing!r}; expected zmp or distance")
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, tuple) and (len(value) != 6 or min(value) < 0.0):
                raise ValueError(f"{field.name} is {value}; expected six numbers >= 0, hip yaw to ankle roll")


_GAIT.check_complete()
