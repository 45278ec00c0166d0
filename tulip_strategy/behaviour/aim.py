"""Where to send the ball: free angles of the goal beside the keeper."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from tulip_description.planar import wrap_angle

Point = tuple[float, float]


@dataclass(frozen=True)
class Gap:
    """A free angle of the goal, seen from the ball.

    Attributes:
        right, left: Its edges [rad], directions in the frame of the points.
    """

    right: float
    left: float

    @property
    def width(self) -> float:
        """Free angle [rad]."""
        return self.left - self.right

    @property
    def middle(self) -> float:
        """Direction of its middle [rad]."""
        return 0.5 * (self.left + self.right)


def free_gaps(
    ball: Point,
    posts: tuple[Point, Point],
    post_radius: float,
    obstacles: Iterable[Point],
    obstacle_radius: float,
    ball_radius: float,
) -> tuple[Gap, ...]:
    """Return the directions in which the ball passes into the goal, from right to left.

    Everything that the ball could touch is made larger by the ball's radius. All points are in one frame.

    Args:
        ball: Ball's centre on the ground [m].
        posts: Axes of the left and the right post, as seen from the field [m].
        post_radius: [m].
        obstacles: Where opponents stand [m]; those farther away than the goal block nothing.
        obstacle_radius: [m].
        ball_radius: [m].
    """
    left_post, right_post = posts
    middle = (0.5 * (left_post[0] + right_post[0]), 0.5 * (left_post[1] + right_post[1]))
    forward = math.atan2(middle[1] - ball[1], middle[0] - ball[0])
    goal_distance = math.dist(ball, middle)

    def seen(point: Point, radius: float) -> tuple[float, float]:
        distance = max(math.dist(ball, point), 1e-6)
        direction = wrap_angle(math.atan2(point[1] - ball[1], point[0] - ball[0]) - forward)
        return direction, math.asin(min(1.0, (radius + ball_radius) / distance))

    left, left_half = seen(left_post, post_radius)
    right, right_half = seen(right_post, post_radius)
    free = [(right + right_half, left - left_half)]
    for point in obstacles:
        if math.dist(ball, point) > goal_distance + obstacle_radius:
            continue
        direction, half = seen(point, obstacle_radius)
        cut = []
        for low, high in free:
            cut += [(low, min(high, direction - half)), (max(low, direction + half), high)]
        free = [(low, high) for low, high in cut if high > low]
    return tuple(Gap(forward + low, forward + high) for low, high in sorted(free) if high > low)


def choose_gap(gaps: tuple[Gap, ...], previous: float | None, preference: float) -> Gap | None:
    """Return the widest gap; the one that holds the previous direction counts `preference` times its width.

    Args:
        gaps: Free gaps, may be empty.
        previous: Direction aimed at before [rad], or None.
        preference: Factor >= 1.
    """

    def worth(gap: Gap) -> float:
        held = previous is not None and abs(wrap_angle(previous - gap.middle)) <= 0.5 * gap.width
        return gap.width * (preference if held else 1.0)

    return max(gaps, key=worth, default=None)
