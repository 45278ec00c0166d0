"""Parameters of motion control: every default stands here, once."""

from __future__ import annotations

from dataclasses import dataclass, fields


@dataclass(frozen=True)
class MotionParameters:
    """Gait, balance and joint control of the legs.

    Six numbers a leg follow the order hip yaw, hip roll, hip pitch, knee, ankle pitch, ankle roll.
    """

    control_period: float = 0.004  # [s] one tick of the driver

    # Gait
    com_height: float = 0.71  # [m] above the ground; leaves the knees bent enough for long steps
    step_time: float = 0.45  # [s] whole step, double support included
    double_support_time: float = 0.06  # [s] of it the ZMP moves from the old to the new stance foot
    first_shift_time: float = 0.5  # [s] the ZMP moves over the first stance foot
    stop_shift_time: float = 0.6  # [s] the ZMP moves back between the feet after the last step
    stance_width: float = 0.24  # [m] between the ankles; hips are 0.267 m apart
    swing_height: float = 0.045  # [m] clears 10 mm of turf and 20 mm of tracking error
    landing_speed: float = 0.15  # [m/s] the foot goes on down when the ground comes late
    zmp_forward: float = 0.040  # [m] aim point of the ZMP ahead of the ankle: the middle of the sole
    zmp_inward: float = 0.0  # [m] aim point towards the other foot
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
    placement_freeze_time: float = 0.08  # [s] before landing; a target that still moved would ask for endless jerk
    placement_gain: float = 1.0  # 1 puts the foot where the DCM will be

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
    side_kick_gap: float = 0.05  # [m] more than ahead, since strategy comes to it sideways
    side_kick_backswing: float = 0.12  # [m] longest run-up; the other foot leaves less room for most directions
    side_kick_shortest_backswing: float = 0.06  # [m]
    side_kick_follow_through: float = 0.12  # [m]
    side_kick_reach_near: float = 0.05  # [m] the ball may lie nearer than expected
    side_kick_reach_far: float = 0.05  # [m] farther
    side_kick_reach_across: float = 0.05  # [m] ahead or behind
    side_kick_speed_ratio: float = 1.18  # ball's speed over the foot's, measured
    max_side_kick_speed: float = 2.0  # [m/s] of the ball
    max_side_kick_direction: float = 0.4  # [rad] either side of straight to the left or right
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
    dcm_gain: float = 2.0  # k in zmp = ref + (1 + k) (dcm - ref)
    zmp_limit_heel: float = 0.08  # [m] behind the aim point
    zmp_limit_toe: float = 0.09  # [m] ahead of the aim point
    zmp_limit_side: float = 0.055  # [m] either side of the aim point
    observer_position_gain: float = 30.0  # [1/s]
    observer_velocity_gain: float = 60.0  # [1/s]
    height_stiffness: float = 100.0  # [1/s^2]
    height_damping: float = 20.0  # [1/s]
    torso_stiffness: float = 60.0  # [1/s^2] IMU attitude to torso angular acceleration
    torso_damping: float = 12.0  # [1/s]

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

    # Falling
    fall_tilt: float = 0.7  # [rad] beyond it no step can save the robot
    upright_tilt: float = 0.25  # [rad] below it a limp robot may stand up again

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
