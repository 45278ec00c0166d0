"""The simulator's validation: its balances keep their bounds, the bounds notice faults, the references obey physics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from tulip_description.materials import GRAVITY
from tulip_description.model import floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_sim import bodies
from tulip_sim.bench import simcheck
from tulip_sim.bench.runner import Row, save, write_results
from tulip_sim.parameters import WorldParameters
from tulip_sim.simcheck import differences
from tulip_sim.simcheck.balance import balance
from tulip_sim.simcheck.compliant_ground import STIFF, CompliantGround
from tulip_sim.simcheck.drop import COM_AHEAD, drop, one_leg_posture
from tulip_sim.simcheck.engine import State
from tulip_sim.simcheck.experiment import on_ground
from tulip_sim.simcheck.flight import flight
from tulip_sim.simcheck.landing import landing
from tulip_sim.simcheck.rigid_engine import SOLES, RigidEngine, sole_jacobian
from tulip_sim.simcheck.study import STUDIES
from tulip_sim.simcheck.swing import swing

ROBOT = load_robot()
MODEL = floating_model(ROBOT)
WEIGHT = ROBOT.mass * GRAVITY
STANDING = standing_posture(ROBOT).joint_positions


@pytest.mark.sim
@pytest.mark.parametrize("name", STUDIES)
def test_energy_momentum_and_spin_of_the_simulator_are_accounted_for(name: str) -> None:
    study = STUDIES[name]()
    for check in study.check(study.simulate(), 1):
        assert check.value <= check.bound, f"{check.what}: {check.value} {check.unit}, bound {check.bound}"


@pytest.mark.sim
def test_hidden_damping_of_the_engine_would_be_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    for damping in ("linearDamping", "angularDamping"):
        monkeypatch.delitem(bodies.QUIET, damping)  # pybullet then damps by 0.04 / s
    study = STUDIES["flight"]()
    beyond = [check.what for check in study.check(study.simulate(), 1) if check.value > check.bound]
    assert {"linear momentum", "spin about the CoM"} <= set(beyond)


@pytest.mark.sim
def test_a_robot_that_is_two_percent_too_heavy_would_be_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    heavy = replace(WorldParameters.exact(), mass_scale=1.02)
    monkeypatch.setattr(WorldParameters, "exact", lambda: heavy)
    study = STUDIES["drop from 1 cm"]()
    beyond = [check.what for check in study.check(study.simulate(), 1) if check.value > check.bound]
    assert "linear momentum" in beyond


@pytest.mark.sim
def test_the_simulator_comes_nearer_to_forward_dynamics_in_proportion_to_its_step() -> None:
    experiment = replace(swing(driven=False), milliseconds=400)
    exact = experiment.compute()
    apart = [differences.angles(experiment.simulate(substeps), exact).value for substeps in (1, 2, 4)]
    assert 0.5 < apart[0] < 5.0  # [mrad]
    assert apart[1] / apart[0] == pytest.approx(0.5, abs=0.03)  # of first order
    assert apart[2] / apart[1] == pytest.approx(0.5, abs=0.03)


@pytest.mark.sim
def test_a_drop_gives_the_same_impulse_and_com_on_pybullets_ground_and_on_stiff_springs() -> None:
    experiment = replace(drop(0.01), milliseconds=120)
    run, other = experiment.simulate(), experiment.compute(STIFF)
    assert differences.impulse(run, other).value < 3.0  # [%]
    assert differences.com(balance(ROBOT, run), balance(ROBOT, other)).value < 1.0  # [mm]


def test_forward_dynamics_keep_energy_momentum_and_spin_in_the_air() -> None:
    experiment = replace(flight(), milliseconds=200)
    found = balance(ROBOT, experiment.compute())
    assert np.abs(found.energy_error).max() < 1e-8 * found.kinetic.max()
    assert np.abs(found.momentum_error).max() < 1e-9 * WEIGHT
    assert np.abs(found.spin_error).max() < 1e-8 * np.linalg.norm(found.spin[0])
    fallen = 0.5 * GRAVITY * 0.2**2
    speed = found.momentum[0, 2] / ROBOT.mass
    assert found.com[-1, 2] - found.com[0, 2] == pytest.approx(speed * 0.2 - fallen, abs=1e-9)


def test_springs_and_dampers_take_energy_and_explain_the_momentum() -> None:
    run = replace(drop(0.005), milliseconds=60).compute(STIFF)
    found = balance(ROBOT, run)
    touched = int(np.argmax(run.contact[:, 2] > 0.0))
    assert touched == pytest.approx(1e3 * np.sqrt(2 * 0.005 / GRAVITY), abs=1.5)  # free fall
    assert found.energy_error.max() < 1e-6
    assert found.energy_error[-1] < -0.03  # [J] the impact took something
    assert np.abs(found.momentum_error).max() < 1e-5
    assert np.abs(found.spin_error).max() < 1e-4  # [N m s] lever arms in the middle of a millisecond


def test_ground_presses_only_and_friction_stays_in_its_cone() -> None:
    rng = np.random.default_rng(1)
    ground, data = CompliantGround(MODEL, ROBOT, STIFF), MODEL.createData()
    standing = on_ground(ROBOT, STANDING, SOLES[0], 0.0)
    loaded = 0
    for _ in range(50):
        q = pin.integrate(MODEL, standing, rng.normal(0.0, 2e-3, MODEL.nv))
        pin.forwardKinematics(MODEL, data, q, rng.normal(0.0, 0.3, MODEL.nv))
        places, forces = ground.forces(data)
        ground.slide(data)
        assert (forces[:, 2] >= 0.0).all()
        assert (forces[places[:, 2] > 0.0] == 0.0).all()
        assert (np.hypot(forces[:, 0], forces[:, 1]) <= STIFF.friction * forces[:, 2] * (1 + 1e-12)).all()
        loaded += int((forces[:, 2] > 0.0).sum())
    assert loaded > 100


def test_an_impact_stops_the_soles_by_impulses_that_act_on_them_and_takes_energy() -> None:
    experiment = landing(0.3, driven=True)
    q, before = experiment.state
    engine = RigidEngine(ROBOT, STANDING)
    engine.set_state(experiment.state)
    after, impulses = engine.impact(before + 1e-3 * np.r_[0.0, 0.0, -GRAVITY, np.zeros(MODEL.nv - 3)])
    falling = before + 1e-3 * np.r_[0.0, 0.0, -GRAVITY, np.zeros(MODEL.nv - 3)]
    data = MODEL.createData()
    inertia = pin.crba(MODEL, data, q)
    jacobian = np.concatenate([sole_jacobian(MODEL, q, sole) for sole in SOLES])
    np.testing.assert_allclose(inertia @ (after - falling), jacobian.T @ impulses.ravel(), atol=1e-9)
    np.testing.assert_allclose(jacobian[:6] @ after, 0.0, atol=1e-9)
    assert impulses[0, 2] > 0.3  # [N s] a leg of some kg stops from 0.3 m/s
    assert after @ inertia @ after < falling @ inertia @ falling


def test_a_sole_that_would_have_to_be_pulled_leaves_the_ground() -> None:
    experiment = landing(0.3, driven=True)
    engine = RigidEngine(ROBOT, STANDING)
    engine.set_state(experiment.state)
    after, impulses = engine.impact(experiment.state.v)  # without weight nothing presses the standing foot down
    assert (impulses[1] == 0.0).all()
    assert (sole_jacobian(MODEL, experiment.state.q, SOLES[1]) @ after)[2] > 0.0


def test_the_dropped_robot_has_its_com_above_the_flat_left_sole_and_lifts_the_right_one() -> None:
    joints = one_leg_posture(ROBOT)
    lower, upper = ROBOT.position_limits
    assert ((lower < joints) & (joints < upper)).all()
    q, data = on_ground(ROBOT, joints, SOLES[0], 0.02), MODEL.createData()
    pin.framesForwardKinematics(MODEL, data, q)
    left, right = (data.oMf[MODEL.getFrameId(sole)] for sole in SOLES)
    np.testing.assert_allclose(left.rotation, np.eye(3), atol=1e-9)
    np.testing.assert_allclose((pin.centerOfMass(MODEL, data, q) - left.translation)[:2], [COM_AHEAD, 0.0], atol=1e-9)
    assert left.translation[2] == pytest.approx(0.02)
    assert right.translation[2] > 0.05


def test_the_landing_foot_comes_straight_down_flat_while_the_rest_is_at_rest() -> None:
    state: State = landing(0.4, driven=True).state
    np.testing.assert_allclose(sole_jacobian(MODEL, state.q, SOLES[0]) @ state.v, [0, 0, -0.4, 0, 0, 0], atol=1e-9)
    np.testing.assert_allclose(sole_jacobian(MODEL, state.q, SOLES[1]) @ state.v, 0.0, atol=1e-12)


def row(value: float) -> Row:
    return {
        "experiment": "flight",
        "steps [ms]": [1.0, 0.5],
        "balances": [{"what": "energy lost", "unit": "J", "values": [value, 0.1], "bounds": [1.0, 0.5]}],
        "differences": [
            {"beside": beside, "what": "CoM", "unit": "mm", "asked": asked, "values": [6.0 * value, 2.0]}
            for beside, asked in (("stiff ground", 5.0), ("soft ground", None))
        ],
        "curves": {"spin about the CoM that nothing explains": {"pybullet, 1 ms": [[0.0, 1.0], [0.0, 0.1]]}},
    }


def test_what_goes_beyond_a_bound_is_named() -> None:
    text = "\n".join(simcheck.summarize([row(2.0)]))
    assert "| flight | 2 of 1 | beyond: energy lost |" in text
    assert "- 0 of 1 balances are within their bounds" in text
    assert "| flight | stiff ground | 12, 2 | parts: CoM |" in text
    assert "| flight | soft ground | 12, 2 |  |" in text


def test_what_keeps_its_bounds_is_said_to_be_within() -> None:
    text = "\n".join(simcheck.summarize([row(0.5)]))
    assert "| flight | 0.5 of 1 | within |" in text
    assert "| flight | stiff ground | 3, 2 | within |" in text


@pytest.mark.sim
def test_a_study_is_measured_drawn_and_published(tmp_path: Path) -> None:
    found = simcheck.measure("landing at 0.3 m/s, loose")
    assert {each["what"] for each in found["balances"]} >= {"energy lost", "linear momentum", "depth of a sole"}
    assert {each["beside"] for each in found["differences"]} == {"rigid impact", "stiff ground"}
    save(simcheck.BENCH, [found], tmp_path)
    simcheck.draw([found], tmp_path / "simcheck.png")
    assert (tmp_path / "simcheck.png").read_bytes().startswith(b"\x89PNG")
    write_results([simcheck.BENCH], tmp_path, tmp_path / "results.md")
    assert "| landing at 0.3 m/s, loose | rigid impact |" in (tmp_path / "results.md").read_text()
