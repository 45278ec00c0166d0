"""Batches: they go on after a kill, tell what they found, and say what is wrong with bad input."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import batch as script
import numpy as np
import pytest
import typer
from scipy import stats
from typer.testing import CliRunner, Result

from tulip_ros.errors import BadInputError
from tulip_sim.batch.jobs import PLAYS, Batch, Job
from tulip_sim.batch.journal import Journal
from tulip_sim.batch.parameter_sets import make_match_settings, make_settings, read_sets
from tulip_sim.batch.results import mean, rate, summarize, write_results
from tulip_sim.bench import batch as bench
from tulip_sim.lockstep import Settings
from tulip_sim.perception import PerceptionParameters

SCRIPT = Path(script.__file__)
SHORT = """
short: &short
  driver:
    rules: {initial_time: 0.2, ready_time: 0.2, set_time: 0.2, playing_time: 0.6}
slow:
  <<: *short
  strategy: {forward_speed: 0.2}
"""
SEEDS = 4
JOBS = {(name, seed) for name in ("short", "slow") for seed in range(1, SEEDS + 1)}
PATIENCE = 120.0  # [s] until a test has failed


def invoke(*arguments: str | Path) -> Result:
    app = typer.Typer()
    app.command()(script.main)
    return CliRunner().invoke(app, [str(word) for word in arguments], catch_exceptions=False)


def command(results: Path, *more: str) -> list[str]:
    sets = results.with_name("sets.yaml")
    sets.write_text(SHORT)
    options = ["--sets", str(sets), "-n", str(SEEDS), "--eyes", "ideal"]
    return [sys.executable, str(SCRIPT), str(results), *options, *more]


def environment() -> dict[str, str]:
    return {**os.environ, "TULIP_NO_VENV": "1", "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}


def table(path: Path) -> list[dict[str, str]]:
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def small_batch(*seeds: int, **sets: Settings) -> Batch:
    return Batch("trial", "trial", sets or {"default": Settings()}, seeds)


def row(seed: int, name: str = "default", **figures: Any) -> dict[str, Any]:
    return {"set": name, "seed": seed, **figures}


def children(pid: int) -> set[int]:
    return {int(each) for each in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()}


@pytest.mark.sim
def test_a_batch_that_is_killed_goes_on_without_loss_or_repetition(tmp_path: Path) -> None:
    results = tmp_path / "results.csv"
    journal = tmp_path / "results.csv.journal"
    words = command(results, "--workers", "2")
    begin = time.monotonic()
    with subprocess.Popen(words, env=environment(), stdout=subprocess.DEVNULL) as killed:
        while not journal.exists() or journal.read_bytes().count(b"\n") < 3:  # its head and two games
            assert killed.poll() is None
            assert time.monotonic() - begin < PATIENCE
            time.sleep(0.01)
        workers = children(killed.pid)
        killed.send_signal(signal.SIGKILL)
        killed.wait()
    before = [json.loads(line) for line in journal.read_bytes().splitlines()[1:] if line.endswith(b"}")]
    assert 2 <= len(before) < len(JOBS)
    assert not results.exists()
    while any(Path(f"/proc/{pid}").exists() for pid in workers):
        assert time.monotonic() - begin < PATIENCE, "workers outlive the batch"
        time.sleep(0.05)
    with open(journal, "ab") as file:
        file.write(b'{"set": "slow", "se')  # cut off by the kill

    again = subprocess.run(words, env=environment(), capture_output=True, text=True, timeout=PATIENCE)
    assert again.returncode == 0, again.stderr
    after = [json.loads(line) for line in journal.read_bytes().splitlines()[1:]]
    assert after[: len(before)] == before
    assert len(after) == len(JOBS)
    rows = table(results)
    assert len(rows) == len(JOBS)
    assert {(each["set"], int(each["seed"])) for each in rows} == JOBS
    assert all(each["outcome"] == "time" and float(each["time"]) == pytest.approx(0.6, abs=0.005) for each in rows)

    idle = subprocess.run(words, env=environment(), capture_output=True, text=True, timeout=PATIENCE)
    assert idle.returncode == 0, idle.stderr
    assert journal.read_bytes().count(b"\n") == len(JOBS) + 1
    assert table(results) == rows


@pytest.mark.sim
@pytest.mark.slow
def test_the_same_batch_on_a_ray_cluster(tmp_path: Path) -> None:
    pytest.importorskip("ray", reason="the package ray (extra `ray`) is not installed")
    pyarrow = pytest.importorskip("pyarrow.parquet", reason="the package pyarrow (extra `batch`) is not installed")
    from ray.cluster_utils import Cluster

    results = tmp_path / "results.parquet"
    cluster = Cluster(
        initialize_head=True,
        head_node_args={"num_cpus": 2, "include_dashboard": False, "object_store_memory": 100 * 2**20},
    )
    try:
        words = command(results, "-n", "2", "--ray", cluster.address)
        played = subprocess.run(words, env=environment(), capture_output=True, text=True, timeout=PATIENCE)
    finally:
        cluster.shutdown()
    assert played.returncode == 0, played.stderr
    rows = pyarrow.read_table(results).to_pylist()
    assert [(each["set"], each["seed"]) for each in rows] == [("short", 1), ("slow", 1), ("short", 2), ("slow", 2)]
    here = PLAYS["trial"].run(2, "trial", read_sets(tmp_path / "sets.yaml", IDEAL, make_settings)["slow"])
    there = next(each for each in rows if (each["set"], each["seed"]) == ("slow", 2))
    assert {name: there[name] for name in here if name != "real_time_factor"} == {
        name: value for name, value in here.items() if name != "real_time_factor"
    }


IDEAL = Settings(perception=PerceptionParameters.ideal())
MATCH = PLAYS["match"].base(PerceptionParameters.ideal())


def test_parameter_sets_address_parameters_as_the_graph_does(tmp_path: Path) -> None:
    path = tmp_path / "sets.json"
    path.write_text(
        json.dumps(
            {
                "plain": None,
                "other": {
                    "driver": {"rules.playing_time": 20, "world": {"ball_mass": 0.4, "sensors": {"period": 8}}},
                    "/striker/strategy": {"ros__parameters": {"forward_speed": 0.3}},
                    "perception": {"quality.latency": 0.5},
                },
            }
        )
    )
    sets = read_sets(path, IDEAL, make_settings)
    assert sets["plain"] == IDEAL
    other = sets["other"]
    assert (other.referee.playing_time, other.world.ball_mass, other.world.sensors.period) == (20.0, 0.4, 8)
    assert other.strategy.forward_speed == 0.3
    assert other.perception is not None
    assert other.perception.latency == 0.5
    assert other.motion == IDEAL.motion


def test_sets_of_a_match_change_both_robots_or_one_of_them(tmp_path: Path) -> None:
    path = tmp_path / "sets.yaml"
    path.write_text(
        """
        duel:
          keeper/strategy: {forward_speed: 0.2}
          strategy: {forward_speed: 0.3, standoff: 0.6}
          driver: {keeper: stand still, rules: {trials: 2, team_numbers: [1, 2]}, world.ball_mass: 0.4}
          /striker/perception: {quality.latency: 0.5}
        """
    )
    settings = read_sets(path, MATCH, make_match_settings)["duel"]
    first, second = settings.robots
    assert (first.strategy.forward_speed, second.strategy.forward_speed) == (0.3, 0.2)
    assert first.strategy.standoff == second.strategy.standoff == 0.6
    assert (settings.keeper, settings.striker) == ("stand still", MATCH.striker)
    assert (settings.rules.trials, settings.rules.team_numbers, settings.world.ball_mass) == (2, (1, 2), 0.4)
    assert first.perception is not None
    assert first.perception.latency == 0.5
    assert second.perception == PerceptionParameters.ideal()
    path.write_text("a: {striker/driver: {striker: stand still}}")
    with pytest.raises(BadInputError, match="share one simulator"):
        read_sets(path, MATCH, make_match_settings)


@pytest.mark.sim
def test_a_batch_of_matches_is_played_to_its_end(tmp_path: Path) -> None:
    sets = tmp_path / "sets.yaml"
    rules = "{trials: 2, extra_pairs: 0, initial_time: 1.2, ready_time: 0.2, set_time: 0.2, playing_time: 0.4}"
    sets.write_text(f"short: {{driver: {{rules: {rules}}}}}")
    results = tmp_path / "results.csv"
    options = ["--play", "match", "-n", "2", "--sets", sets, "--eyes", "ideal", "--workers", "1"]
    played = invoke(results, *options)
    assert played.exit_code == 0, played.output
    assert "matches won by magenta" in played.output
    rows = table(results)
    assert [(each["seed"], each["trials"]) for each in rows] == [("1", "2"), ("2", "2")]
    assert all(each["decided_by"] == "draw" for each in rows)
    assert all(float(each["simulated_time"]) > 4.0 for each in rows)
    assert all(float(each[f"{name}_localization_error"]) < 0.2 for each in rows for name in ("cyan", "magenta"))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "holds no set; expected `set: {node: {name: value}}`"),
        ("- 1", "holds no set"),
        ("a: 3", "set a holds int; expected `node: {name: value}`"),
        ("a: {stratgy: {}}", "There is no node in .*, set a called 'stratgy'. Did you mean strategy"),
        ("a: {strategy: {forward_sped: 1.0}}", "no parameter of node 'strategy' called 'forward_sped'. Did you mean"),
        ("a: {strategy: {forward_speed: fast}}", "strategy.forward_speed is 'fast'; expected a number"),
        ("a: {strategy: {forward_speed: -1.0}}", "forward_speed is -1.0; expected > 0"),
        ("a: {driver: {seed: 3}}", "no parameter of node 'driver' called 'seed'"),
        ("a: {recorder: {}}", "no node with parameters in lockstep called 'recorder'"),
        ("a: {perception: {}}", "no node with parameters in lockstep called 'perception'"),
        ("a: {", "is no valid YAML"),
    ],
)
def test_bad_parameter_sets_are_named(tmp_path: Path, text: str, words: str) -> None:
    path = tmp_path / "sets.yaml"
    path.write_text(text)
    with pytest.raises(BadInputError, match=words):
        read_sets(path, Settings(), make_settings)


def test_jobs_are_all_sets_with_all_seeds_in_turn() -> None:
    batch = small_batch(4, 5, a=Settings(), b=IDEAL)
    assert batch.jobs() == [Job("a", 4), Job("b", 4), Job("a", 5), Job("b", 5)]


def test_a_journal_keeps_rows_and_drops_a_line_that_was_cut_off(tmp_path: Path) -> None:
    path, batch = tmp_path / "journal", small_batch(1, 2, 3)
    with Journal(path, batch) as journal:
        journal.add(row(1, time=2.5))
        journal.add(row(2, time=None))
    whole = path.read_bytes()
    for cut in range(1, 12):
        path.write_bytes(whole[:-cut])
        with Journal(path, batch) as journal:
            assert journal.rows == [row(1, time=2.5)]
            assert journal.done() == {Job("default", 1)}
            journal.add(row(2, time=None))
        assert path.read_bytes() == whole
    for cut in range(1, whole.index(b"\n")):
        path.write_bytes(whole[:cut])
        with Journal(path, batch) as journal:
            assert journal.rows == []


def test_a_journal_takes_more_seeds_but_no_other_batch(tmp_path: Path) -> None:
    path = tmp_path / "journal"
    with Journal(path, small_batch(1)) as journal:
        journal.add(row(1))
        with pytest.raises(BadInputError, match="is being written by another batch"):
            Journal(path, small_batch(1))
    with Journal(path, small_batch(1, 2, 3)) as journal:
        assert len(journal.rows) == 1
    slow = make_settings({"strategy": {"forward_speed": 0.2}}, Settings())
    for other, words in (
        (small_batch(1, default=slow), "parameters of set default differ"),
        (small_batch(1, default=Settings(), slow=slow), "only one of the two has parameter set slow"),
        (Batch("trial", "open", {"default": Settings()}, [1]), "its scenario is 'trial', not 'open'"),
    ):
        before = path.read_bytes()
        with pytest.raises(BadInputError, match=words):
            Journal(path, other)
        assert path.read_bytes() == before


@pytest.mark.parametrize("content", [b"diary\n", b"{}\n", b'{"format": 1', b"dear diary", b"[1, 2]\n"])
def test_a_file_that_is_no_journal_is_left_alone(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "journal"
    path.write_bytes(content)
    if content == b'{"format": 1':  # begun, and killed
        with Journal(path, small_batch(1)) as journal:
            assert journal.rows == []
        return
    with pytest.raises(BadInputError, match="is no journal of a batch"):
        Journal(path, small_batch(1))
    assert path.read_bytes() == content


def test_rates_have_wilsons_interval_and_means_students() -> None:
    estimate = rate("goals", [True] * 8 + [False] * 2)
    # Wilson (1927): (p + z^2/2n +- z sqrt(p(1-p)/n + z^2/4n^2)) / (1 + z^2/n)
    z, n, p = stats.norm.ppf(0.975), 10, 0.8
    middle, half = p + z**2 / (2 * n), z * np.sqrt(p * (1 - p) / n + z**2 / (4 * n**2))
    assert (estimate.low, estimate.high) == pytest.approx(
        ((middle - half) / (1 + z**2 / n), (middle + half) / (1 + z**2 / n))
    )
    assert str(estimate) == "80 % (49 to 94)"
    estimate = mean("time [s]", [1.0, 2.0, 3.0])
    assert (estimate.value, estimate.high - estimate.value) == pytest.approx((2.0, 4.302653 / np.sqrt(3.0)))
    assert str(mean("time [s]", [])) == "-"
    assert str(mean("time [s]", [2.0])) == "2.00"


def test_the_summary_counts_only_what_it_says(tmp_path: Path) -> None:
    figures = {"distance_walked": 2.0, "localization_error": 0.1, "heading_error": None, "real_time_factor": 3.0}
    rows = [
        row(1, scored=True, fell=False, time=10.0, **figures),
        row(2, scored=False, fell=True, time=150.0, **figures),
        row(1, "other", scored=True, fell=False, time=30.0, **figures),
    ]
    estimates = {name: {each.name: each for each in own} for name, own in summarize(rows, PLAYS["trial"]).items()}
    assert estimates["default"]["goals"].value == 0.5
    assert (estimates["default"]["time to goal [s]"].value, estimates["default"]["time to goal [s]"].count) == (10.0, 1)
    assert estimates["other"]["time to goal [s]"].value == 30.0
    assert estimates["default"]["heading error [deg]"].count == 0
    write_results(tmp_path / "results.csv", rows)
    assert [(each["set"], each["seed"]) for each in table(tmp_path / "results.csv")] == [
        ("default", "1"),
        ("other", "1"),
        ("default", "2"),
    ]
    assert [path.name for path in tmp_path.iterdir()] == ["results.csv"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["{folder}/results.txt"], "ends in '.txt'; expected .csv or .parquet"),
        (["{folder}/nowhere/results.csv"], "cannot be written: No such file or directory"),
        (["{folder}/results.csv", "--play", "chess"], "There is no play 'chess'. Known: "),
        (["{folder}/results.csv", "--play", "match", "--scenario", "open"], "a match begins by its own rules"),
        (["{folder}/results.csv", "--scenario", "moon"], "There is no scenario 'moon'"),
        (["{folder}/results.csv", "--eyes", "closed"], "There is no eyes 'closed'"),
        (["{folder}/results.csv", "--sets", "{folder}/none.yaml"], "none.yaml cannot be read: No such file"),
        (["{folder}/results.csv", "--ray", "auto", "--workers", "2"], "expected it without --ray"),
    ],
)
def test_bad_input_ends_with_exit_code_2_and_one_line(tmp_path: Path, arguments: list[str], words: str) -> None:
    result = invoke(*(word.format(folder=tmp_path) for word in arguments))
    assert result.exit_code == 2
    assert words in result.output
    assert result.output.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("arguments", [["-n", "0"], ["--workers", "0"], ["--first-seed", "-1"]])
def test_numbers_out_of_range_are_refused(tmp_path: Path, arguments: list[str]) -> None:
    result = invoke(tmp_path / "results.csv", *arguments)
    assert result.exit_code == 2
    assert "greater than or equal to" in " ".join(result.output.replace("│", " ").split())


def test_a_cluster_that_does_not_exist_is_named(tmp_path: Path) -> None:
    pytest.importorskip("ray", reason="the package ray (extra `ray`) is not installed")
    results = tmp_path / "results.csv"
    words = command(results, "--ray", "localhost:x")
    refused = subprocess.run(words, env=environment(), capture_output=True, text=True, timeout=PATIENCE)
    assert refused.returncode == 2
    assert "error: There is no Ray cluster at 'localhost:x'" in refused.stderr


def test_the_bench_tells_the_ratio() -> None:
    rows = [
        {"workers": workers, "repeat": 0, "games": bench.GAMES, "wall-clock time [s]": elapsed}
        for workers, elapsed in ((1, 60.0), (2, 30.0))
    ]
    assert f"| 2 | 30.0 s | {2 * bench.GAMES:.1f} | 2.00 |" in bench.summarize(rows)
