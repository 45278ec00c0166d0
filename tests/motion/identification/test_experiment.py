"""The experiment in the simulator, on a robot whose masses it does not know."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import HEAD_JOINTS, Robot, load_robot
from tulip_motion.identification.experiment import Experiment
from tulip_motion.identification.experiment_plan import FootPlan, PlanParameters, make_plan
from tulip_motion.identification.passages import Doing
from tulip_motion.identification.progress import Progress
from tulip_sim.lockstep_experiment import run_experiment
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.secret_body import secret_body
from tulip_sim.truth import Truth
from tulip_sim.world import World

ROBOT = load_robot()
SECRET = secret_body(ROBOT, np.random.default_rng(11))

pytestmark = pytest.mark.sim


@pytest.fixture(scope="module")
def plans() -> tuple[FootPlan, ...]:
    """One posture on each foot, of a plan for more."""
    whole = make_plan(ROBOT, PlanParameters(postures=9, candidates=40))
    return tuple(replace(plan, visits=plan.visits[:1]) for plan in whole)


@pytest.fixture
def world() -> World:
    start = Scenario(robot=Pose2D(), ball=(0.0, -2.5), poles=False)
    return World(start, WorldParameters(mass_spread=0.0), 1, true_body=SECRET)


def true_cop(robot: Robot, truth: Truth, side: str) -> np.ndarray:
    """Return (2,) where the line of gravity through the true CoM meets the true sole, in its frame [m]."""
    model = floating_model(robot)
    data = model.createData()
    q = np.concatenate([truth.base_position, truth.base_orientation, truth.joint_positions])
    pin.framesForwardKinematics(model, data, q)
    com = pin.centerOfMass(model, data, q)
    sole = data.oMf[model.getFrameId("l_sole" if side == "left" else "r_sole")]
    normal = sole.rotation[:, 2]
    drop = (com - sole.translation) @ normal / normal[2]
    return np.array(sole.actInv(com - [0.0, 0.0, drop])[:2])


def tilt(truth: Truth) -> float:
    return float(np.arccos(quaternion_matrix(truth.base_orientation.tolist())[2, 2]))


def stands_on_both_feet(world: World) -> bool:
    loads = world.sensors().foot_cells.sum(axis=1)
    return bool(loads.min() > 60.0 and tilt(world.truth()) < 0.1)


def test_postures_of_a_wrong_model_are_held_and_the_cop_is_below_the_true_com(
    plans: tuple[FootPlan, ...], world: World, tmp_path: Path
):
    experiment = Experiment(ROBOT, plans)
    cops: dict[int, list[np.ndarray]] = {}

    def tell(topic: str, stamp: int, value: object) -> None:
        if topic == "ground_truth" and experiment.progress.doing is Doing.HOLD:
            number = experiment.progress.posture
            side = "left" if number < 1 else "right"
            cops.setdefault(number, []).append(true_cop(SECRET, world.truth(), side))

    end = run_experiment(experiment, world, tell)
    assert (end.held, end.left_out, end.reason) == (2, (), "")
    assert [hold.side for hold in experiment.holds] == ["left", "right"]
    for hold, measurement in zip(experiment.holds, experiment.measurements, strict=True):
        # The true CoM while it was averaged: the last 1.2 s of the hold, told at 50 Hz.
        assert measurement.cop == pytest.approx(np.mean(cops[hold.posture][-60:], axis=0), abs=0.5e-3)
        assert measurement.normal_force == pytest.approx(SECRET.mass * 9.81, rel=0.01)
        assert np.sqrt(np.diag(measurement.cop_covariance)).max() < 0.3e-3
    assert stands_on_both_feet(world)


@pytest.mark.parametrize("doing", [Doing.SHIFT, Doing.LIFT, Doing.MOVE, Doing.HOLD, Doing.LOWER])
def test_abort_in_every_passage_leads_to_a_stand_on_both_feet(doing: Doing, plans: tuple[FootPlan, ...], world: World):
    experiment = Experiment(ROBOT, plans[:1])
    since = 0

    def watch(now: float, progress: Progress) -> None:
        nonlocal since
        since = since + 1 if progress.doing is doing else 0
        if since == 20:  # 0.4 s into it
            experiment.abort("the test wants it")

    end = run_experiment(experiment, world, watch=watch, longest=60.0)
    assert (end.finished, end.reason, end.doing) == (True, "the test wants it", Doing.STAND)
    assert not experiment.is_limp
    assert stands_on_both_feet(world)


def disturbed(world: World, experiment: Experiment, disturb: Callable[[], None]) -> Progress:
    """Disturb once when a posture is being held, and let the experiment end."""
    done = False

    def watch(now: float, progress: Progress) -> None:
        nonlocal done
        if progress.doing is Doing.HOLD and not done:
            done = True
            disturb()

    return run_experiment(experiment, world, watch=watch, longest=60.0)


def test_a_robot_that_is_told_to_go_limp_lets_its_legs_go_and_stays_so(plans: tuple[FootPlan, ...], world: World):
    experiment = Experiment(ROBOT, plans)
    end = disturbed(world, experiment, lambda: experiment.go_limp("the test wants it"))
    assert (end.doing, end.reason, end.finished) == (Doing.LIMP, "the test wants it", True)
    command = experiment.tick(world.sensors())
    legs = [name not in HEAD_JOINTS for name in command.names]
    assert sum(legs) == 12
    assert not np.any(command.stiffness[legs]) and not np.any(command.effort[legs])
    assert not stands_on_both_feet(world)
    experiment.abort("too late")
    assert experiment.progress.reason == "the test wants it"


def test_a_push_that_throws_the_robot_over_makes_it_limp(plans: tuple[FootPlan, ...], world: World):
    experiment = Experiment(ROBOT, plans)
    end = disturbed(world, experiment, lambda: world.push([0.0, 200.0, 0.0], 150))
    assert end.doing is Doing.LIMP
    assert end.reason
    command = experiment.tick(world.sensors())
    assert (command.stiffness[:12] == 0.0).all()


def test_a_nudge_during_a_hold_is_waited_out(plans: tuple[FootPlan, ...], world: World):
    experiment = Experiment(ROBOT, plans[:1])
    end = disturbed(world, experiment, lambda: world.push([10.0, 0.0, 0.0], 100))
    assert (end.held, end.reason) == (1, "")
    assert stands_on_both_feet(world)
