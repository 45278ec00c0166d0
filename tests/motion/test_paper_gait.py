"""The paper's gait: eqs. (3)-(4) of one step, and steps stitched together."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tulip_description.planar import Pose2D
from tulip_motion.footsteps import Footstep
from tulip_motion.gait import FootMotion, Reference
from tulip_motion.interface import Side, Support
from tulip_motion.lipm import LipmState, advance_lipm
from tulip_motion.mirrored_step import (
    Axes,
    MirroredStep,
    StepShape,
    periodic_state,
    printed_height,
    rocking_zmps,
    step_between,
)
from tulip_motion.paper_gait import PaperGait, sideways_limit
from tulip_motion.parameters import MotionParameters

P = MotionParameters(gait="paper")
PRINTED = StepShape(0.45, 0.71, 0.045, 0.0, "sat", 0.0, (0.04, 0.0))
LED = StepShape(0.45, 0.71, 0.045, 0.1, "smooth", 0.08, (0.04, 0.02))
WIDTH = 0.24
LIMITS = (0.08, 0.09, 0.055)
DT = 0.004
Velocity = tuple[float, float, float]

coordinates = st.floats(-0.2, 0.2)
states = st.tuples(st.builds(LipmState, coordinates, coordinates), st.builds(LipmState, coordinates, coordinates))
ways = st.tuples(st.floats(-0.13, 0.13), st.floats(-0.05, 0.05))


def printed_step(side: Side, start: Axes) -> MirroredStep:
    """Return the step of eqs. (3)-(4) as they are printed."""
    ends = [advance_lipm(state, 0.0, PRINTED.time_constant, PRINTED.duration) for state in start]
    before = Pose2D(2.0 * start[0].position, 2.0 * start[1].position)
    return MirroredStep(
        PRINTED, side, start, (0.0, 0.0), before, Pose2D(2.0 * ends[0].position, 2.0 * ends[1].position)
    )


@given(st.sampled_from(Side), states)
def test_any_state_comes_back_exactly_after_two_printed_steps(side: Side, start: Axes) -> None:
    once = printed_step(side, start).next_start()
    twice = printed_step(side.other, once).next_start()
    np.testing.assert_allclose(twice, start, atol=1e-13)


@given(st.sampled_from(Side), ways)
def test_a_printed_step_ends_in_the_periodic_state_of_the_other_foot(side: Side, way: tuple[float, float]) -> None:
    step = printed_step(side, periodic_state(PRINTED, side, WIDTH, way))
    np.testing.assert_allclose(step.next_start(), periodic_state(PRINTED, side.other, WIDTH, way), atol=1e-13)
    sideways = WIDTH if side is Side.RIGHT else -WIDTH
    assert (step.after.x, step.after.y) == pytest.approx((way[0], sideways + way[1]), abs=1e-13)


@given(st.sampled_from(Side), states, st.floats(0.0, 0.45))
def test_the_printed_swing_foot_is_at_twice_the_com(side: Side, start: Axes, time: float) -> None:
    step = printed_step(side, start)
    foot, com = step.foot(time), step.com(time)
    sole = (foot.position[0] + 0.04, foot.position[1])  # its pivot
    assert sole == pytest.approx((2.0 * com[0].position, 2.0 * com[1].position), abs=1e-14)
    assert foot.velocity[:2] == pytest.approx((2.0 * com[0].velocity, 2.0 * com[1].velocity), abs=1e-14)


@given(st.floats(0.01, 0.15), st.floats(0.0, 0.45), st.sampled_from((1.0, -1.0)))
def test_the_height_is_the_printed_law_for_every_stride(way: float, time: float, sign: float) -> None:
    step = printed_step(Side.LEFT, periodic_state(PRINTED, Side.LEFT, WIDTH, (sign * way, 0.0)))
    foot_speed = PRINTED.com_height / abs(step.start[0].position)  # v_f: up at the beginning, down at the end
    law = printed_height(step.com(time)[0].position, PRINTED.com_height, foot_speed, PRINTED.height)
    assert step.foot(time).position[2] == pytest.approx(law, abs=1e-12)


def test_the_printed_height_is_clipped_to_the_ground_and_to_its_top() -> None:
    assert printed_height(0.0, 0.71, 10.0, 0.045) == 0.045
    assert printed_height(0.1, 0.71, 10.0, 0.045) == 0.0
    assert printed_height(-0.069, 0.71, 10.0, 0.045) == pytest.approx(0.71 - 0.69)


@given(st.floats(1e-6, 0.45 - 1e-6))
def test_the_lift_time_limits_the_speed_of_the_law_and_nothing_else(time: float) -> None:
    limited = replace(PRINTED, lift_time=0.05)
    law, limit = PRINTED.vertical(time)[0], 0.045 * min(time, 0.45 - time) / 0.05
    assert limited.vertical(time)[0] == pytest.approx(min(law, limit), abs=1e-14)
    assert abs(limited.vertical(time)[1]) <= 0.045 / 0.05 + 1e-12


@settings(max_examples=40)
@given(st.sampled_from((PRINTED, LED)), states, states, st.floats(-0.3, 0.3), st.floats(0.0, 1.0))
def test_velocities_and_accelerations_are_derivatives(
    shape: StepShape, start: Axes, target: Axes, turn: float, share: float
) -> None:
    h = 1e-5
    corners = [0.0, shape.settle_time, shape.lift_time, 0.225, 0.45]
    # The printed law's two corners, where it reaches its top: there is no derivative.
    corners += [0.225 - shape.time_constant * math.asinh((1 - 0.045 / 0.71) * math.sinh(0.225 / shape.time_constant))]
    corners += [0.45 - corner for corner in corners]
    time = share * 0.45
    if min(abs(time - corner) for corner in corners) < 2 * h:
        return
    step = step_between(shape, Side.LEFT, start, Pose2D(0.05, -0.22, 0.1), turn, target, LIMITS)
    earlier, now, later = (step.foot(time + k * h) for k in (-1, 0, 1))
    np.testing.assert_allclose(now.velocity, np.subtract(later.position, earlier.position) / (2 * h), atol=1e-5)
    np.testing.assert_allclose(now.acceleration, np.subtract(later.velocity, earlier.velocity) / (2 * h), atol=1e-3)
    assert now.yaw_rate == pytest.approx((later.yaw - earlier.yaw) / (2 * h), abs=1e-6)
    assert now.yaw_acceleration == pytest.approx((later.yaw_rate - earlier.yaw_rate) / (2 * h), abs=1e-4)
    coms = [np.array(step.com(time + k * h)) for k in (-1, 0, 1)]
    np.testing.assert_allclose(coms[1][:, 1], (coms[2] - coms[0])[:, 0] / (2 * h), atol=1e-7)
    np.testing.assert_allclose(step.com_acceleration(step.com(time)), (coms[2] - coms[0])[:, 1] / (2 * h), atol=1e-6)


def test_a_foot_that_settles_begins_and_ends_at_rest_on_the_printed_places() -> None:
    start = periodic_state(LED, Side.LEFT, WIDTH, (0.1, 0.0))
    target = periodic_state(LED, Side.RIGHT, WIDTH, (0.1, 0.0))
    step = step_between(LED, Side.LEFT, start, Pose2D(-0.1, -WIDTH), 0.0, target, LIMITS)
    for time, place in ((0.0, -0.1), (0.45, 0.1)):
        foot = step.foot(time)
        np.testing.assert_allclose(foot.position, [place - 0.04, -WIDTH - 0.02 + 0.02 - 0.02, 0.0], atol=1e-12)
        np.testing.assert_allclose(foot.velocity, 0.0, atol=1e-12)
        np.testing.assert_allclose(foot.acceleration, 0.0, atol=1e-9)


@given(ways, ways)
def test_speed_changes_by_the_pivot_alone(way: tuple[float, float], change: tuple[float, float]) -> None:
    start = periodic_state(PRINTED, Side.LEFT, WIDTH, way)
    faster = way[0] + 0.3 * change[0], way[1] + 0.3 * change[1]
    target = periodic_state(PRINTED, Side.RIGHT, WIDTH, faster)
    before = Pose2D(2.0 * start[0].position, 2.0 * start[1].position)
    step = step_between(PRINTED, Side.LEFT, start, before, 0.0, target, LIMITS)
    scale = -0.3 / (4.0 * math.sinh(0.225 / PRINTED.time_constant) ** 2)
    assert step.pivot == pytest.approx((scale * change[0], scale * change[1]), abs=1e-13)
    end = step.com(0.45)
    assert (step.after.x, step.after.y) == pytest.approx((2 * end[0].position, 2 * end[1].position), abs=1e-13)
    np.testing.assert_allclose(step.next_start(), target, atol=1e-13)


@given(states, states, st.floats(-0.2, 0.2))
def test_a_step_leads_to_any_state_that_its_pivot_allows(start: Axes, target: Axes, turn: float) -> None:
    wide = (10.0, 10.0, 10.0)
    step = step_between(PRINTED, Side.RIGHT, start, Pose2D(0.0, WIDTH), turn, target, wide)
    np.testing.assert_allclose(step.next_start(), target, atol=1e-12)


@given(coordinates, coordinates, coordinates, coordinates)
def test_two_places_of_the_zmp_lead_from_state_to_state(x0: float, v0: float, x1: float, v1: float) -> None:
    tc = PRINTED.time_constant
    first, second = rocking_zmps(LipmState(x0, v0), LipmState(x1, v1), tc, 0.5)
    end = advance_lipm(advance_lipm(LipmState(x0, v0), first, tc, 0.5), second, tc, 0.5)
    np.testing.assert_allclose(end, (x1, v1), atol=1e-11)


def test_the_sideways_limit_is_where_the_mirrored_feet_come_too_near() -> None:
    limit = sideways_limit(PRINTED, WIDTH, 0.165)
    for speed, near in ((limit - 1e-4, False), (limit + 1e-4, True)):
        distances = [
            abs(2.0 * printed_step(side, periodic_state(PRINTED, side, WIDTH, (0.0, 0.45 * speed))).com(t)[1].position)
            for side in Side
            for t in np.linspace(0.0, 0.45, 500)
        ]
        assert (min(distances) < 0.165) is near


class Ideal:
    """The gait on feet that land exactly where they were sent."""

    def __init__(self, parameters: MotionParameters = P, start: Pose2D | None = None) -> None:
        start = start or Pose2D(0.5, -0.3, 0.7)
        feet = tuple(Footstep(side, start @ Pose2D(0.0, y)) for side, y in ((Side.LEFT, 0.12), (Side.RIGHT, -0.12)))
        self.gait = PaperGait(parameters, (feet[0], feet[1]), start.transform((parameters.zmp_forward, 0.0)))
        self.poses = [feet[0].pose, feet[1].pose]
        self.references: list[Reference] = []

    def go(self, seconds: float, wanted: Velocity | None) -> None:
        for _ in range(round(seconds / DT)):
            if self.gait.finished:
                return
            if self.references:
                last = self.references[-1]
                foot: FootMotion = last.other
                if isinstance(part := self.gait._part, MirroredStep):
                    self.poses[last.stance.side.other] = last.stance.pose @ _sole(part)
                elif last.support is Support.DOUBLE:
                    self.poses[last.stance.side.other] = Pose2D(*foot.position[:2], foot.yaw)
            self.references.append(self.gait.tick(DT, wanted, (0.0, 0.0), self.poses.__getitem__, (0.0, 0.0)))


def _sole(step: MirroredStep) -> Pose2D:
    """Return where the swing foot's sole lands, from the stance foot's sole."""
    forward, left = step.shape.sole_offset(step.side)
    other_forward, other_left = step.shape.sole_offset(step.side.other)
    return Pose2D(forward, left) @ step.after @ Pose2D(-other_forward, -other_left)


velocities = st.tuples(st.floats(-0.4, 0.4), st.floats(-0.15, 0.15), st.floats(-0.4, 0.4))


@settings(max_examples=10)
@given(st.lists(velocities, min_size=1, max_size=3))
def test_the_whole_gait_is_continuous_and_ends_at_rest_between_the_feet(commands: list[Velocity]) -> None:
    ideal = Ideal()
    for velocity in commands:
        ideal.go(2.0, velocity)
    ideal.go(8.0, None)
    assert ideal.gait.finished
    coms = [reference.com for reference in ideal.references]
    omega_squared = 1.0 / PRINTED.time_constant**2
    for before, after in itertools.pairwise(coms):
        assert before is not None and after is not None
        # Between two ticks the ZMP may change; both positions and velocities go on from where they were.
        reach = omega_squared * 0.3 * DT
        assert np.abs(after.velocity - before.velocity).max() < reach
        assert np.abs(after.position - before.position - DT * before.velocity).max() < reach * DT
    last, end = ideal.references[-1], coms[-1]
    assert end is not None
    np.testing.assert_allclose(end.velocity, 0.0, atol=1e-9)
    middle = [0.5 * (a + b) for a, b in zip(*(pose.transform((0.04, 0.0)) for pose in ideal.poses), strict=True)]
    np.testing.assert_allclose(end.position, middle, atol=1e-9)
    assert last.support is Support.DOUBLE
    beside = ideal.poses[Side.RIGHT].inverse() @ ideal.poses[Side.LEFT]
    np.testing.assert_allclose(beside.as_array(), [0.0, P.stance_width, 0.0], atol=1e-9)


@settings(max_examples=10)
@given(velocities)
def test_feet_stay_apart_and_the_zmp_inside_the_stance_sole(velocity: Velocity) -> None:
    ideal = Ideal()
    ideal.go(4.0, velocity)
    for reference in ideal.references:
        if reference.support is Support.DOUBLE:
            continue
        x, y = reference.stance.pose.inverse().transform(reference.zmp)
        assert -P.zmp_limit_heel <= x - P.zmp_forward <= P.zmp_limit_toe
        assert abs(y) <= P.zmp_limit_side + 1e-12
        foot = reference.other
        away = reference.stance.pose.inverse().transform((float(foot.position[0]), float(foot.position[1])))[1]
        # A turn brings the ankles nearer by what the pivots, 0.04 m ahead, swing about them.
        assert abs(away) > P.min_foot_distance - 2.0 * P.zmp_forward * abs(math.sin(velocity[2] * P.paper_step_time))


@pytest.mark.parametrize("velocity", [(0.2, 0.0, 0.0), (-0.2, 0.0, 0.0), (0.0, 0.1, 0.0), (0.1, 0.05, 0.3)])
def test_the_gait_advances_by_the_commanded_velocity(velocity: Velocity) -> None:
    ideal = Ideal(start=Pose2D())
    ideal.go(6.0, velocity)

    def pair() -> Pose2D:
        left, right = ideal.poses
        yaw = 0.5 * (left.yaw + right.yaw)
        return Pose2D(0.5 * (left.x + right.x), 0.5 * (left.y + right.y), yaw)

    begin, steps = pair(), ideal.gait.step_count
    ideal.go(1.8, velocity)
    assert ideal.gait.step_count - steps == 4
    moved = begin.inverse() @ pair()
    turn = 4 * 0.45 * velocity[2]
    assert moved.yaw == pytest.approx(turn, abs=1e-9)
    if turn == 0.0:
        assert (moved.x, moved.y) == pytest.approx((1.8 * velocity[0], 1.8 * velocity[1]), abs=1e-9)
    else:  # along an arc
        chord = math.hypot(moved.x, moved.y)
        way = 1.8 * math.hypot(velocity[0], velocity[1])
        assert chord == pytest.approx(way * math.sin(turn / 2) / (turn / 2), rel=0.01)


def test_a_command_beyond_the_law_is_clipped_and_named() -> None:
    ideal = Ideal()
    ideal.go(3.0, (0.1, 0.5, 0.0))
    limit = sideways_limit(
        PRINTED, P.stance_width - 2 * P.paper_zmp_inward, P.min_foot_distance - 2 * P.paper_zmp_inward
    )
    assert ideal.gait.velocity == pytest.approx((0.1, limit, 0.0))
    (note,) = ideal.gait.notes
    assert note.startswith(f"speed sideways of 0.50 m/s is more than the paper's gait can: {limit:.2f}")
    ideal.go(1.0, (0.1, 0.0, 0.0))
    assert ideal.gait.notes == ()


def test_what_is_measured_does_not_change_the_plan() -> None:
    exact, slipped = Ideal(start=Pose2D()), Ideal(start=Pose2D())
    exact.go(4.0, (0.2, 0.0, 0.0))
    for _ in range(1000):
        poses = [Pose2D(0.03, 0.5, 0.2), Pose2D(-0.2, 0.1, -0.3)]  # wherever the feet are found
        slipped.references.append(slipped.gait.tick(DT, (0.2, 0.0, 0.0), (9.0, 9.0), poses.__getitem__, (500.0, 500.0)))
    for a, b in zip(exact.references, slipped.references, strict=True):
        assert a.support is b.support and a.com is not None and b.com is not None
        seen = [
            reference.stance.pose.inverse().transform((float(place[0]), float(place[1])))
            for reference in (a, b)
            if reference.com is not None
            for place in (reference.com.position, reference.other.position)
        ]
        np.testing.assert_allclose(seen[:2], seen[2:], atol=1e-12)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gait": "trot"}, "gait is 'trot'; expected dcm or paper"),
        ({"paper_swing": "round"}, "paper_swing"),
        ({"feedforward": "all"}, "feedforward"),
        ({"weight_sharing": "half"}, "weight_sharing"),
        ({"paper_lift_time": 0.3}, "paper_lift_time is 0.3 s"),
        ({"paper_settle_time": -0.1}, "paper_settle_time"),
        ({"paper_swing": "smooth", "paper_lift_time": 0.0}, "expected > 0 with paper_swing smooth"),
        ({"gait": "paper", "paper_step_time": 0.9}, "closer than min_foot_distance"),
    ],
)
def test_parameters_refuse_what_the_gait_cannot_do(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(MotionParameters(), **changes)  # type: ignore[arg-type]
