"""What the ground, the ball and the goals are made of, for physics engines and exported models."""

from __future__ import annotations

from dataclasses import dataclass

GRAVITY = 9.81  # [m/s^2] as in the robot's models
SOLE_FRICTION = 1.0  # of the soles themselves; engines that multiply do so with the carpet's
BALL_FRICTION = 0.7  # against the feet; against the carpet it is multiplied with the carpet's
POST_FRICTION = 0.5  # of posts, poles and figures
NET_FRICTION = 1.0
HOLLOW_SPHERE = 2.0 / 3.0  # inertia of a thin shell in m r^2


@dataclass(frozen=True)
class Materials:
    """Contacts and friction.

    Attributes:
        friction: Of the soles on the carpet.
        ball_mass: [kg].
        ball_rolling_deceleration: Of a ball that rolls on the carpet [m/s^2].
        ball_stiffness, ball_damping: Of contacts with the ball [N/m], [N s/m].
        net_stiffness, net_damping: Of the nets against the ball [N/m], [N s/m].
        joint_friction: Dry friction of each joint as a share of its torque limit.
    """

    friction: float
    ball_mass: float
    ball_rolling_deceleration: float
    ball_stiffness: float
    ball_damping: float
    net_stiffness: float
    net_damping: float
    joint_friction: float

    def ball_inertia(self, radius: float) -> float:
        """Moment of inertia of the ball, a thin shell, about any axis [kg m^2], given its radius [m]."""
        return HOLLOW_SPHERE * self.ball_mass * radius**2

    def rolling_arm(self, radius: float) -> float:
        """Coefficient of rolling friction [m] of a ball of this radius [m].

        A rolling resistance torque arm * m g slows a rolling ball by arm g / (r (1 + I / (m r^2))).
        """
        return self.ball_rolling_deceleration * radius * (1.0 + HOLLOW_SPHERE) / GRAVITY
