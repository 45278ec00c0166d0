"""Parameters of the simulated world: what is uncertain about it, and how its sensors err."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from tulip_description.materials import Materials
from tulip_driver.guard import GuardParameters, check_leg_gains
from tulip_sim.faults import read_fault

ENGINES = ("pybullet", "mujoco")
"""Physics engines that can stand behind a world."""
STEP = 0.001  # [s] of physics


@dataclass(frozen=True)
class SensorParameters:
    """Errors of the sensors. Standard deviations unless said otherwise; all assumed, from ordinary components.

    Resolutions are powers of two, as a counter in a register has them.
    """

    period: int = 4  # [ms] one reading of the whole body per control tick
    encoder_step: float = 2.0**-13  # [rad] 1.2e-4: resolution of a 16-bit encoder at the joint
    encoder_noise: float = 1e-4  # [rad]
    velocity_noise: float = 0.02  # [rad/s] of the motor-side encoder, differentiated over 1 ms
    velocity_step: float = 2.0**-8  # [rad/s] 0.004
    effort_step: float = 2.0**-6  # [N m] 0.016: a 14-bit current sensor
    gyro_noise: float = 0.005  # [rad/s] per reading
    gyro_step: float = 2.0**-11  # [rad/s] 0.0005: 16 bits for +-16
    gyro_bias: float = 0.002  # [rad/s] constant in a run
    accelerometer_noise: float = 0.05  # [m/s^2]
    accelerometer_bias: float = 0.02  # [m/s^2] constant in a run
    accelerometer_step: float = 2.0**-9  # [m/s^2] 0.002: 16 bits for +-64
    attitude_noise: float = 0.001  # [rad] of the IMU's own orientation estimate, white
    attitude_step: float = 2.0**-16  # of the quaternion's parts: 3e-5 rad
    attitude_bias: float = 0.003  # [rad] roll and pitch, constant in a run: mounting
    yaw_drift: float = 0.0003  # [rad/s] constant in a run: about 1 degree per minute without a magnetometer
    cell_noise: float = 1.0  # [N]
    cell_step: float = 0.5  # [N] resolution

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is negative or not finite.
        """
        for name, value in vars(self).items():
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value}; expected a finite number >= 0")
        if self.period < 1:
            raise ValueError(f"period is {self.period} ms; expected >= 1")


@dataclass(frozen=True)
class DriverParameters(GuardParameters):
    """Behaviour of the joint driver: the guard's, and that of the simulated motors."""

    full_torque_speed: float = 0.8  # share of the top speed up to which full torque is there; it falls to 0 at the top
    # Until the first command the legs hold the start posture with these gains, which carry the robot in double support.
    hold_stiffness: tuple[float, ...] = (150.0, 400.0, 400.0, 400.0, 200.0, 200.0)  # [N m/rad] [trial]
    hold_damping: tuple[float, ...] = (3.0, 8.0, 8.0, 8.0, 2.0, 0.4)  # [N m s/rad] [trial]
    head_hold: tuple[float, float] = (20.0, 0.3)  # [N m/rad], [N m s/rad]

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is out of its range.
        """
        super().__post_init__()
        check_leg_gains("hold_stiffness", self.hold_stiffness)
        check_leg_gains("hold_damping", self.hold_damping)
        if not 0.0 < self.full_torque_speed < 1.0:
            raise ValueError(f"full_torque_speed is {self.full_torque_speed}; expected between 0 and 1")


@dataclass(frozen=True)
class WorldParameters:
    """The physical world. Ranges are drawn from once, when a world is made, by its seed."""

    engine: str = "pybullet"  # or mujoco, the project's extra of that name
    friction: tuple[float, float] = (0.6, 1.0)  # range of the friction coefficient on the carpet
    mass_scale: float = 1.0  # all masses and inertias by those of the robot file, that motion control does not know of
    mass_spread: float = 0.05  # each link's mass and inertia: +- this share
    joint_friction: tuple[float, float] = (0.0, 0.01)  # range of each joint's dry friction, share of its torque limit
    joint_friction_speed: float = 1.0  # [rad/s] over which dry friction builds up: a step of 1 ms needs it smooth
    sensor_delay: tuple[int, int] = (0, 2)  # [ms] range, from measuring to reading; an answer waits 4 ms more
    ball_mass: float = 0.43  # [kg]
    ball_rolling_deceleration: float = 0.35  # [m/s^2] of a ball rolling on carpet; assumed: 2 m/s carries 5.7 m
    ball_stiffness: float = 1.5e4  # [N/m] of contacts with the ball; bounces as a ball does [trial]
    ball_damping: float = 8.0  # [N s/m] [trial]
    net_stiffness: float = 2.0e3  # [N/m] a net gives way
    net_damping: float = 100.0  # [N s/m] and takes the ball's speed: overdamped with this ball
    solver_iterations: int = 50  # [trial]
    faults: tuple[str, ...] = ()  # of the sensors, from a moment on: see tulip_sim/faults.py
    sensors: SensorParameters = field(default_factory=SensorParameters)
    driver: DriverParameters = field(default_factory=DriverParameters)

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is out of its range.
        """
        if self.engine not in ENGINES:
            raise ValueError(f"engine is {self.engine!r}; expected {' or '.join(ENGINES)}")
        for name in ("friction", "joint_friction", "sensor_delay"):
            low, high = getattr(self, name)
            if not 0.0 <= low <= high:
                raise ValueError(f"{name} is ({low}, {high}); expected 0 <= low <= high")
        if self.friction[0] <= 0.0:
            raise ValueError(f"friction begins at {self.friction[0]}; expected > 0")
        if not 0.0 <= self.mass_spread < 1.0:
            raise ValueError(f"mass_spread is {self.mass_spread}; expected in [0, 1)")
        for name in (
            "mass_scale",
            "ball_mass",
            "ball_stiffness",
            "net_stiffness",
            "solver_iterations",
            "joint_friction_speed",
        ):
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected > 0")
        for name in ("ball_rolling_deceleration", "ball_damping", "net_damping"):
            if not getattr(self, name) >= 0:
                raise ValueError(f"{name} is {getattr(self, name)}; expected >= 0")
        for line in self.faults:
            read_fault(line)

    @classmethod
    def exact(cls) -> WorldParameters:
        """Return a world without randomness: nominal masses, friction 0.8, no joint friction, sensors without error."""
        sensors = SensorParameters(
            encoder_step=0.0,
            encoder_noise=0.0,
            velocity_noise=0.0,
            velocity_step=0.0,
            effort_step=0.0,
            gyro_noise=0.0,
            gyro_step=0.0,
            gyro_bias=0.0,
            accelerometer_noise=0.0,
            accelerometer_bias=0.0,
            accelerometer_step=0.0,
            attitude_noise=0.0,
            attitude_step=0.0,
            attitude_bias=0.0,
            yaw_drift=0.0,
            cell_noise=0.0,
            cell_step=0.0,
        )
        return cls(
            friction=(0.8, 0.8), mass_spread=0.0, joint_friction=(0.0, 0.0), sensor_delay=(0, 0), sensors=sensors
        )


def materials_of(parameters: WorldParameters, friction: float | None = None) -> Materials:
    """Return what a world is made of.

    pybullet's spring of a contact is implicit: its force is that of the depth after the step, K (d + h d') + B d', so
    it damps with B + h K. That is how its ball bounces, and what other engines have to be given.

    Args:
        parameters: Of the world.
        friction: Of its carpet, as drawn; None for the middle of the range. Joint friction is the middle of its range.
    """
    p = parameters
    return Materials(
        friction=sum(p.friction) / 2 if friction is None else friction,
        ball_mass=p.ball_mass,
        ball_rolling_deceleration=p.ball_rolling_deceleration,
        ball_stiffness=p.ball_stiffness,
        ball_damping=p.ball_damping + STEP * p.ball_stiffness,
        net_stiffness=p.net_stiffness,
        net_damping=p.net_damping + STEP * p.net_stiffness,
        joint_friction=sum(p.joint_friction) / 2,
    )
