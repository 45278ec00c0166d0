"""Iterative learning over steps: mirrored, bounded, convergent, never worse, kept between runs."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.interface import MotionMode, Side, Support
from tulip_motion.iterative_learning import AdaptiveLaw, WaveformLaw, mirrored, nodes_of, on_nodes, smoother
from tulip_motion.learning_file import LARGEST, LearningFile, LearningFileError, load
from tulip_motion.parameters import MotionParameters
from tulip_motion.step_learning import StepLearner, key_of, mirror_key
from tulip_sim.bench.body import Body

WAVEFORM = MotionParameters(learning="waveform")
ADAPTIVE = MotionParameters(learning="adaptive")
LIMITS = load_robot().effort_limits[:12]
DT = WAVEFORM.control_period
STILL = (0.2, 0.0, 0.0)


class Leg:
    """Twelve joints held by their gains against a disturbance that repeats, mirrored, with each step.

    The ankles of the stance leg, which the waveform leaves to balance, do not count. The joints are simulated
    finely; a torque acts one tick after the error that it answers, as on the robot.
    """

    def __init__(self, learner: StepLearner, parameters: MotionParameters, disturbance: float = 3.0) -> None:
        self.learner = learner
        self.nodes = nodes_of(parameters)
        self.stiffness = np.tile(parameters.swing_stiffness, 2)
        self.damping = np.tile(parameters.swing_damping, 2)
        self.inertia = self.stiffness / 40.0**2  # natural frequency 6 Hz, that of a swinging leg
        self.disturbance = disturbance
        self.position, self.velocity, self.torque = np.zeros(12), np.zeros(12), np.zeros(12)
        self.step = 0
        self.peak = 0.0
        self.jump = 0.0

    def walk(self, steps: int, noise: float = 0.0, velocity: tuple[float, float, float] | None = STILL) -> list[float]:
        """Take steps and return the RMS of the joint angles' errors of each [rad]."""
        rng = np.random.default_rng(1)
        found = []
        for _ in range(steps):
            self.step += 1
            side = Side(self.step % 2)
            squares = 0.0
            for tick in range(self.nodes):
                phase = tick / self.nodes
                rise = np.sin(np.pi * phase) ** 2  # smooth from step to step
                shape = self.disturbance * rise * np.cos(np.arange(12)) * LIMITS / 65.0
                push = shape if side is Side.LEFT else mirrored(shape)
                answer = self.learner.tick(
                    side,
                    Support.LEFT if side is Side.LEFT else Support.RIGHT,
                    phase,
                    self.step,
                    velocity,
                    False,
                    -self.position + noise * rng.standard_normal(12),
                    -self.velocity + 200.0 * noise * rng.standard_normal(12),
                ).copy()
                for _ in range(8):
                    drive = self.torque + push - self.stiffness * self.position - self.damping * self.velocity
                    self.velocity += DT / 8 * drive / self.inertia
                    self.position += DT / 8 * self.velocity
                self.jump = max(self.jump, float(np.abs((answer - self.torque) / LIMITS).max()))
                self.torque = answer
                self.peak = max(self.peak, float(np.abs(answer / LIMITS).max()))
                counted = np.delete(self.position, [4, 5] if side is Side.LEFT else [10, 11])
                squares += float(counted @ counted)
            found.append((squares / (10 * self.nodes)) ** 0.5)
        return found


def test_mirroring_twice_is_no_change_and_exchanges_the_legs() -> None:
    values = np.random.default_rng(0).normal(size=(5, 12))
    np.testing.assert_array_equal(mirrored(mirrored(values)), values)
    np.testing.assert_array_equal(mirrored(np.arange(12.0)), [-6, -7, 8, 9, 10, -11, -0, -1, 2, 3, 4, -5])


@pytest.mark.parametrize(
    "law", [WaveformLaw(replace(WAVEFORM, learning_mirror_share=1.0), LIMITS), AdaptiveLaw(ADAPTIVE)]
)
def test_a_step_teaches_the_next_one_on_the_other_foot_the_mirrored_torque(law: WaveformLaw | AdaptiveLaw) -> None:
    rng = np.random.default_rng(0)
    memory = np.zeros(law.shape)
    phases = np.linspace(0.0, 1.0, 112)
    law.learn(memory, Side.LEFT, phases, rng.normal(size=(112, 12)), rng.normal(size=(112, 12)), None)
    rate = rng.normal(size=12)
    left = [law.torque(row, rate) for row in law.playable(memory, Side.LEFT)]
    right = [law.torque(row, mirrored(rate)) for row in law.playable(memory, Side.RIGHT)]
    assert np.abs(left).max() > 0.01
    np.testing.assert_allclose(mirrored(np.array(left)), right, atol=1e-12)


def test_velocities_have_the_same_key_as_their_mirror_image_on_the_other_foot() -> None:
    assert key_of((0.4, 0.1, -0.5), Side.LEFT) == key_of((0.4, -0.1, 0.5), Side.RIGHT)
    assert key_of((0.4, 0.1, -0.5), Side.RIGHT) == mirror_key(key_of((0.4, 0.1, -0.5), Side.LEFT))


def test_what_a_step_did_not_reach_teaches_nothing() -> None:
    values = np.ones((80, 12))
    found = on_nodes(np.linspace(0.0, 0.7, 80), values, 100, 0.0)
    assert found[:69].all() and not found[71:].any()


@pytest.mark.parametrize("ticks", [90, 112])  # a step in place, and one at 0.4 m/s
def test_the_lead_is_the_same_time_in_short_and_long_steps(ticks: int) -> None:
    law = WaveformLaw(replace(WAVEFORM, learning_smoothing=0.0, learning_gain=1.0), LIMITS)
    memory, peak = np.zeros(law.shape), 60
    feedback = np.zeros((ticks, 12))
    feedback[peak - 1 : peak + 2] = 1.0  # three ticks wide, so that a node of either length meets it
    law.learn(memory, Side.LEFT, np.arange(ticks) / ticks, np.zeros((ticks, 12)), feedback, None)
    nodes = memory.shape[1]
    found = (np.flatnonzero(memory[0, :, 3]) + 0.5) / nodes * ticks  # [ticks] where the torque will act
    assert np.mean(found) == pytest.approx(
        peak - WAVEFORM.learning_lead / DT, abs=0.5 * ticks / nodes + 0.5
    )  # half a node and a tick's half


def test_smoothing_keeps_constants_and_shifts_nothing() -> None:
    margin, matrix = smoother(50, 2.0)
    np.testing.assert_allclose(matrix @ np.ones(50 + 2 * margin), np.ones(50))
    line = np.arange(-margin, 50.0 + margin)
    np.testing.assert_allclose(matrix @ line, np.arange(50.0), atol=1e-9)


def test_the_waveform_takes_the_repeated_error_below_a_quarter_within_ten_steps_and_keeps_it_there() -> None:
    leg = Leg(StepLearner(WAVEFORM, LIMITS), WAVEFORM)
    errors = leg.walk(100)
    assert max(errors[12:]) < 0.25 * errors[1]
    assert leg.learner.note == ""


def test_the_adaptive_law_lowers_the_repeated_error() -> None:
    leg = Leg(StepLearner(ADAPTIVE, LIMITS), ADAPTIVE)
    errors = leg.walk(50)
    assert max(errors[20:]) < 0.98 * errors[1]  # damping alone does not hold against a slow disturbance


@pytest.mark.parametrize("parameters", [WAVEFORM, ADAPTIVE])
def test_noise_alone_teaches_little_and_stays_within_the_bound(parameters: MotionParameters) -> None:
    leg = Leg(StepLearner(parameters, LIMITS), parameters, disturbance=0.0)
    errors = leg.walk(120, noise=1.5e-4)  # as encoders have
    assert leg.peak <= parameters.learning_bound
    assert max(errors[90:]) < 1.5 * max(errors[10:60]) + 1e-5  # no growth
    assert max(errors) < 1e-3  # [rad]


def test_theta_stays_clamped_however_large_the_error() -> None:
    law = AdaptiveLaw(ADAPTIVE)
    memory = np.zeros(law.shape)
    rates = np.full((112, 12), 50.0)
    for _ in range(20):
        law.learn(memory, Side.LEFT, np.linspace(0.0, 1.0, 112), rates, rates, None)
    most = ADAPTIVE.learning_damping_bound
    assert (memory[..., 0] + ADAPTIVE.learning_beta * memory[..., 1]).max() == pytest.approx(most)
    assert memory.min() >= 0.0


def test_torque_is_bounded_however_large_the_disturbance() -> None:
    leg = Leg(StepLearner(WAVEFORM, LIMITS), WAVEFORM, disturbance=60.0)
    leg.walk(30)
    assert leg.peak == pytest.approx(WAVEFORM.learning_bound)


def test_torque_fades_in_and_out_without_a_jump() -> None:
    leg = Leg(StepLearner(WAVEFORM, LIMITS), WAVEFORM, disturbance=40.0)
    leg.walk(6)
    assert np.abs(leg.peak) > 0.05
    leg.walk(1, velocity=None)
    assert not leg.torque.any()
    leg.walk(3)
    assert 0.0 < leg.jump <= WAVEFORM.learning_bound * DT / 0.04 + 1e-9


def test_it_switches_itself_off_and_says_so_when_the_error_grows() -> None:
    learner = StepLearner(WAVEFORM, LIMITS)
    leg = Leg(learner, WAVEFORM)
    leg.walk(20)
    assert learner.note == ""
    leg.disturbance = 30.0  # as of another floor: ten times what was known without torque
    errors = leg.walk(10)
    assert "switched off" in learner.note and "mrad RMS" in learner.note
    leg.walk(2)
    assert not leg.torque.any()  # faded out
    assert max(errors) > 0.0
    leg.walk(5)
    assert not leg.torque.any()


def test_a_learner_that_makes_things_worse_ends_where_it_began() -> None:
    # A lead of half the step turns the correction round: learning with it pumps the error up.
    wrong = replace(WAVEFORM, learning_lead=0.5 * WAVEFORM.step_time, learning_gain=1.0)
    learner = StepLearner(wrong, LIMITS)
    leg = Leg(learner, wrong)
    errors = leg.walk(40)
    assert "switched off" in learner.note
    assert max(errors) < 4.0 * errors[1]
    assert errors[-1] == pytest.approx(errors[1], rel=0.05)


def test_a_foot_that_scuffs_teaches_nothing_and_pauses_the_torque() -> None:
    learner = StepLearner(WAVEFORM, LIMITS)
    leg = Leg(learner, WAVEFORM)
    leg.walk(10)
    known = {key: situation.memory.copy() for key, situation in learner.situations.items()}
    for tick in range(112):
        learner.tick(Side.LEFT, Support.LEFT, tick / 112, 50, STILL, 40 < tick < 60, np.full(12, 0.1), np.zeros(12))
    for tick in range(112):
        torque = learner.tick(Side.RIGHT, Support.RIGHT, tick / 112, 51, STILL, False, np.zeros(12), np.zeros(12))
    assert not torque.any()
    for key, memory in known.items():
        if key == key_of(STILL, Side.LEFT):
            assert np.abs(learner.situations[key].memory - memory).max() < 1.0  # the ordinary step before it taught


def test_the_first_step_and_steps_without_velocity_teach_nothing() -> None:
    learner = StepLearner(WAVEFORM, LIMITS)
    leg = Leg(learner, WAVEFORM)
    leg.walk(1)
    assert not learner.situations
    leg.walk(4, velocity=None)
    assert not learner.situations and not learner.changed


@pytest.mark.parametrize("parameters", [WAVEFORM, ADAPTIVE])
def test_what_was_learned_is_kept_in_a_file(parameters: MotionParameters, tmp_path: Path) -> None:
    parameters = replace(parameters, learning_file=str(tmp_path / "new" / "learned.npz"))
    learner = StepLearner(parameters, LIMITS)
    file = LearningFile(parameters, load_robot(), learner)
    assert file.note == ""
    Leg(learner, parameters).walk(10)
    file.save()
    again = StepLearner(parameters, LIMITS)
    assert LearningFile(parameters, load_robot(), again).note == ""
    assert again.situations.keys() == learner.situations.keys() != set()
    for key, situation in learner.situations.items():
        np.testing.assert_array_equal(again.situations[key].memory, situation.memory)
        np.testing.assert_array_equal(again.situations[key].baselines, situation.baselines)


def test_a_file_that_does_not_fit_is_refused_with_the_reason(tmp_path: Path) -> None:
    path = tmp_path / "learned.npz"
    parameters = replace(WAVEFORM, learning_file=str(path))

    def refusal(other: MotionParameters) -> str:
        fresh = StepLearner(other, LIMITS)
        note = LearningFile(other, load_robot(), fresh).note
        assert bool(note) != bool(fresh.situations)
        return note

    kept = StepLearner(parameters, LIMITS)
    keeper = LearningFile(parameters, load_robot(), kept)
    Leg(kept, parameters).walk(10)
    keeper.save()
    assert refusal(parameters) == ""
    assert refusal(replace(parameters, max_kick_speed=3.0)) == ""  # a kick is no step
    assert f"step_time {parameters.step_time}; expected 0.5" in refusal(replace(parameters, step_time=0.5))
    assert "learning waveform; expected adaptive" in refusal(replace(parameters, learning="adaptive"))
    path.write_bytes(path.read_bytes()[:200])
    assert "damaged" in refusal(parameters)
    path.write_text("no file of numpy")
    assert "damaged" in refusal(parameters)
    path.unlink()
    path.mkdir()
    assert "damaged" in refusal(parameters)
    assert "another robot" in _note_for_other_robot(tmp_path)


def test_a_folder_keeps_what_each_gait_learned_apart(tmp_path: Path) -> None:
    slow = replace(WAVEFORM, learning_file=str(tmp_path / "learned"))
    quick = replace(slow, step_time=0.5)
    found = {}
    for parameters in (slow, quick):
        learner = StepLearner(parameters, LIMITS)
        file = LearningFile(parameters, load_robot(), learner)
        assert file.note == "" and not learner.situations  # the other gait's memory is neither taken nor refused
        Leg(learner, parameters).walk(10)
        file.save()
        found[parameters.step_time] = learner.situations
    assert len(list((tmp_path / "learned").iterdir())) == 2
    for parameters in (slow, quick):
        again = StepLearner(parameters, LIMITS)
        assert LearningFile(parameters, load_robot(), again).note == ""
        for key, situation in found[parameters.step_time].items():
            np.testing.assert_array_equal(again.situations[key].memory, situation.memory)


def _note_for_other_robot(folder: Path) -> str:
    parameters = replace(WAVEFORM, learning_file=str(folder / "other.npz"))
    learner = StepLearner(parameters, LIMITS)
    file = LearningFile(parameters, load_robot("table"), learner)
    Leg(learner, parameters).walk(10)
    file.save()
    return LearningFile(parameters, load_robot(), StepLearner(parameters, LIMITS)).note


def test_what_did_harm_is_not_kept(tmp_path: Path) -> None:
    path = tmp_path / "learned.npz"
    parameters = replace(WAVEFORM, learning_file=str(path))
    learner = StepLearner(parameters, LIMITS)
    file = LearningFile(parameters, load_robot(), learner)
    Leg(learner, parameters).walk(10)
    learner.note = "switched off"
    file.save()
    assert not path.exists()


@pytest.mark.parametrize(
    "change", [{"learning": "magic"}, {"learning_gain": 2.0}, {"learning_margin": 0.9}, {"learning_gamma_cross": 20.0}]
)
def test_parameters_that_cannot_be_are_refused(change: dict[str, object]) -> None:
    with pytest.raises(ValueError, match="learning"):
        replace(WAVEFORM, **change)


@pytest.mark.sim
def test_a_walking_robot_halves_its_joint_errors_and_has_no_learned_torque_once_it_stands(tmp_path: Path) -> None:
    path = tmp_path / "learned.npz"
    body = Body(1, Pose2D(-4.0, 2.2, 0.0), parameters=replace(WAVEFORM, learning_file=str(path)))
    body.go(0.5)
    assert not body.motion.state().torque_learned.any()
    body.go(9.0, STILL)
    state = body.motion.state()
    assert state.torque_learned.any()
    assert state.notes == ()
    body.go(3.0)
    assert body.motion.mode is MotionMode.STAND
    assert not body.motion.state().torque_learned.any()
    body.motion.save_learning()
    assert path.exists()

    def error_over_a_second(walker: Body) -> float:
        squares = []
        for _ in range(250):
            before = walker.motion.state().joint_positions_desired
            walker.go(DT, STILL)
            squares.append(np.square(before - walker.motion.state().joint_positions).mean())
        return float(np.mean(squares) ** 0.5)

    body.go(3.0, STILL)
    plain = Body(1, Pose2D(-4.0, 2.2, 0.0))
    plain.go(4.0, STILL)
    assert error_over_a_second(body) < 0.6 * error_over_a_second(plain)


def test_a_file_that_holds_more_than_was_ever_learned_is_refused_before_it_is_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "learned.npz"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in ("version", "owner", "keys", "memories", "baselines"):
            archive.writestr(f"{name}.npy", bytes(LARGEST))
    assert path.stat().st_size < LARGEST // 100
    with pytest.raises(LearningFileError, match="expected at most"):
        load(path, {}, (12, 5))


def test_a_file_of_torn_arrays_or_texts_is_refused_in_words(tmp_path: Path) -> None:
    path = tmp_path / "learned.npz"
    beyond = np.frombuffer(np.full(30, 0x7FFFFFFF, np.uint32).tobytes(), "<U30")[0:1].reshape(())
    with path.open("wb") as file:
        np.savez(
            file, version=np.array(1), owner=beyond, keys=np.zeros((1, 3)), memories=np.zeros(1), baselines=np.zeros(1)
        )
    with pytest.raises(LearningFileError, match="damaged"):
        load(path, {}, (12, 5))
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("version.npy", b"\x93NUMPY\x01\x00\x06\x00{'de\n(")
    with pytest.raises(LearningFileError, match="damaged"):
        load(path, {}, (12, 5))
