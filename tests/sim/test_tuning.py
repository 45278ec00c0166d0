"""The gait tuner: it runs, goes on, writes a gait file, and says what is wrong with bad input."""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import product
from pathlib import Path

import pytest
import tune
import typer
from typer.testing import CliRunner, Result

from tulip_motion.gait_file import PATH, GaitFile, GaitFileError, read_gait, write_gait
from tulip_motion.parameters import MotionParameters
from tulip_ros.plan import read_parameters
from tulip_sim import tuning
from tulip_sim.bench.push import DIRECTIONS, PHASES
from tulip_sim.tuner import Tuner, TuningSettings
from tulip_sim.tuning import REFUSED, SPACE, WEAK_PUSHES, Figures, evaluate, pushes_of, try_pushes, try_walk

SHORT = ["--trials", "1", "--seeds", "1", "--seconds", "1", "--workers", "1"]


def run(*arguments: str) -> Result:
    app = typer.Typer()
    app.command()(tune.main)
    return CliRunner().invoke(app, [*SHORT, *arguments], catch_exceptions=False)


def test_gait_file_holds_exactly_the_parameters_that_have_bounds_and_inside_them() -> None:
    gait = read_gait(PATH)
    assert list(gait) == list(SPACE)
    for name, value in gait.items():
        assert SPACE[name][0] <= value <= SPACE[name][1], name


def test_defaults_of_motion_come_from_the_gait_file() -> None:
    gait, defaults = read_gait(PATH), MotionParameters()
    assert set(gait) <= {field.name for field in fields(MotionParameters)}
    for name, value in gait.items():
        assert getattr(defaults, name) == value


def test_gait_file_is_a_parameter_file_of_the_graph() -> None:
    assert read_parameters(PATH) == {"motion": read_gait(PATH)}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("motion:\n  ros__parameters:\n    speed: fast\n", "speed is 'fast'; expected a finite number"),
        ("motion:\n  ros__parameters:\n    speed: .nan\n", "expected a finite number"),
        ("motion: 3\n", "not a parameter file of node motion"),
        ("", "not a parameter file of node motion"),
        ("motion: [\n", "is not YAML"),
    ],
)
def test_a_bad_gait_file_is_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "gait.yaml"
    path.write_text(text)
    with pytest.raises(GaitFileError, match=message):
        read_gait(path)


def test_missing_and_unknown_names_in_a_gait_file_are_named(tmp_path: Path) -> None:
    path = tmp_path / "gait.yaml"
    write_gait(path, {"step_time": 0.4, "steptime": 0.5}, ["try"])
    gait = GaitFile(path)
    assert gait.value("step_time") == 0.4
    with pytest.raises(GaitFileError, match="lacks com_height"):
        gait.value("com_height")
    with pytest.raises(GaitFileError, match="has steptime, which motion does not take"):
        gait.check_complete()
    with pytest.raises(GaitFileError, match="cannot be read"):
        GaitFile(tmp_path / "none.yaml")


def test_cost_orders_survival_then_pushes_then_speed_then_effort_then_drift() -> None:
    good = Figures(1.0, 1.0, 1.0, 0.7, 0.7, 0.0)
    drifts, fast_joints = replace(good, drift=0.2), replace(good, joint_speed=1.0)
    strains, slow, falls = replace(good, torque=1.0), replace(good, speed=0.8), replace(good, survival=0.9)
    pushed_over = replace(good, pushes=15.0 / 16.0)
    costs = [each.cost for each in (good, drifts, fast_joints, strains, slow, pushed_over, falls)]
    assert costs == sorted(costs) and len(set(costs)) == len(costs)


@pytest.mark.sim
def test_a_gait_that_cannot_walk_costs_more_than_the_committed_one() -> None:
    gait = MotionParameters()
    committed = try_walk("forward", gait, 0, 3.0)
    clumsy = try_walk("forward", replace(gait, dcm_gain=0.0, placement_gain=0.0), 0, 3.0)
    assert committed["survival"] == 1.0
    assert cost(committed) < cost(clumsy)


def cost(walk: dict[str, float]) -> float:
    return Figures(pushes=1.0, **walk).cost


@pytest.mark.parametrize("gait", [{"step_time": 0.5}, {"stance_width": 0.285, "step_time": 0.38}, {"com_height": 9.0}])
def test_a_gait_that_is_too_slow_or_impossible_is_not_tried(gait: dict[str, float]) -> None:
    assert evaluate(gait, range(1), 1e9) == REFUSED


def test_two_seeds_are_pushed_in_all_the_weak_ways_and_eighteen_in_every_way_of_the_bench() -> None:
    seen = [{push[:2] for push in pushes_of(seed)} for seed in range(18)]
    assert set(WEAK_PUSHES) <= seen[0] | seen[1]
    assert set().union(*seen) == set(product(DIRECTIONS, PHASES))
    assert len(seen[0]) == len(pushes_of(0)) == 8
    assert not seen[0] & seen[1]
    assert pushes_of(3) == pushes_of(3)


@pytest.mark.sim
def test_a_push_counts_fully_when_it_is_survived_and_by_the_time_upright_when_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    light, strong = (0, 0.6, 4.0), (0, 0.6, 30.0)
    monkeypatch.setattr(tuning, "pushes_of", lambda seed: [light, strong])
    held, fell = try_pushes(MotionParameters(), 0)
    assert held == 1.0
    assert 0.02 < fell < 0.5  # it takes some time to fall, and by far not all of it


@pytest.mark.sim
def test_a_gait_that_does_not_come_to_the_push_earns_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tuning, "pushes_of", lambda seed: [(0, 1.5, 11.0)])
    assert try_pushes(MotionParameters(), 0) == [0.0]
    monkeypatch.setattr(tuning, "pushes_of", lambda seed: [(0, 0.6, 11.0)])
    falls = replace(MotionParameters(), weight_sharing="distance")
    assert try_pushes(falls, 0) == [0.0]


def test_values_that_motion_refuses_cost_more_than_any_fall() -> None:
    assert evaluate({"step_time": 0.01}, [0], 1.0).cost > 100.0


@pytest.mark.sim
def test_a_study_runs_goes_on_and_is_applied_to_a_gait_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tuning, "pushes_of", lambda seed: [(0, 0.2, 11.0)])  # workers are copies of this process
    study, gait = tmp_path / "study.jsonl", tmp_path / "gait.yaml"
    first = run("--study", str(study), "--space", "step_time,dcm_gain")
    assert first.exit_code == 0, first.output
    assert "Best of 1" in first.output
    second = run("--study", str(study), "--space", "step_time,dcm_gain", "--apply", "--gait", str(gait))
    assert second.exit_code == 0, second.output
    assert "Best of 2" in second.output
    values = read_gait(gait)
    assert list(values) == list(SPACE)
    changed = {name for name, value in values.items() if value != read_gait(PATH)[name]}
    assert changed <= {"step_time", "dcm_gain"}
    assert "in unseen worlds" in second.output
    assert "Best of 2 gaits" in gait.read_text()
    assert "In 2 that none had seen before" in gait.read_text()
    other = run("--study", str(study), "--seconds", "2")
    assert other.exit_code == 2
    assert "was begun with --seeds 1 --seconds 1" in other.output


def test_a_trial_that_was_broken_off_is_tried_again(tmp_path: Path) -> None:
    settings = TuningSettings(1, 1.0, read_gait(PATH))
    left = Tuner(tmp_path / "study.jsonl", settings)
    asked = left._study.ask()  # and then the process is killed
    value = asked.suggest_float("step_time", *SPACE["step_time"])
    again = Tuner(tmp_path / "study.jsonl", settings)
    assert again.finished == 0
    assert again._study.ask().suggest_float("step_time", *SPACE["step_time"]) == value


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("this is no journal\n", "is damaged or no study"),
        ('{"op_code": 4, "worker_id": "a"}\n', "is damaged or no study"),
    ],
)
def test_a_damaged_study_is_refused(tmp_path: Path, content: str, message: str) -> None:
    study = tmp_path / "study.jsonl"
    study.write_text(content)
    result = run("--study", str(study))
    assert result.exit_code == 2
    assert message in result.output


def test_bad_input_of_the_script_is_refused_before_anything_is_tried(tmp_path: Path) -> None:
    wrong = run("--study", str(tmp_path / "s.jsonl"), "--space", "step_tim")
    assert wrong.exit_code == 2
    assert "Did you mean step_time" in wrong.output
    unwritable = run("--study", str(tmp_path / "no" / "s.jsonl"))
    assert unwritable.exit_code == 2
    assert "cannot be written" in unwritable.output
    folder = run("--study", str(tmp_path))
    assert folder.exit_code == 2
    gait = run("--study", str(tmp_path / "s.jsonl"), "--apply", "--gait", str(tmp_path / "no" / "g.yaml"))
    assert gait.exit_code == 2
    assert "--gait" in gait.output
    nothing = run("--study", str(tmp_path / "s.jsonl"), "--trials", "0")
    assert nothing.exit_code == 2
    assert "no finished trial" in nothing.output
