"""The soak bench: slopes with their confidence, samples on the disk, what a process holds, and matches in a row."""

from __future__ import annotations

import json
import mmap
import os
import threading
import uuid
from pathlib import Path

import numpy as np
import pytest

from tulip_sim.bench import soak
from tulip_sim.bench.soaking import graph, lockstep, samples
from tulip_sim.bench.soaking.resources import FILES, MEMORY, SHARED_MEMORY, THREADS, resources, shared_memory_files
from tulip_sim.bench.soaking.samples import SIMULATED, Sample
from tulip_sim.bench.soaking.slopes import Series, fit
from tulip_sim.match_rules import MatchRules
from tulip_sim.match_settings import MatchSettings
from tulip_sim.perception import PerceptionParameters
from tulip_sim.robot_stack import RobotSettings

HOURS = np.linspace(0.0, 8.0, 481)  # a sample each minute


def walk(rng: np.random.Generator, correlation: float) -> np.ndarray:
    """Return noise of unit spread whose neighbours are correlated: x_k = r x_(k-1) + e_k."""
    noise = rng.normal(0.0, np.sqrt(1.0 - correlation**2), len(HOURS))
    values = [rng.normal()]
    for each in noise[1:]:
        values.append(correlation * values[-1] + each)
    return np.array(values)


def test_a_leak_of_two_megabytes_an_hour_is_found_beneath_noise_of_one() -> None:
    values = 300.0 + 2.0 * HOURS + np.random.default_rng(1).normal(0.0, 1.0, len(HOURS))
    slope = fit([(HOURS, values)], warm_up=0.5)
    assert slope is not None and slope.verdict == "grows"
    assert slope.per_hour == pytest.approx(2.0, abs=slope.margin) and slope.margin < 0.1


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_the_interval_holds_the_true_slope_19_times_in_20_for_correlated_samples_too(correlation: float) -> None:
    rng = np.random.default_rng(2)
    slopes = [fit([(HOURS, walk(rng, correlation))], warm_up=0.0) for _ in range(300)]
    held = np.mean([slope is not None and slope.verdict == "flat" for slope in slopes])
    assert 0.90 < held < 0.99  # 0.95 +- 0.0126 by the binomial law


def test_a_figure_that_never_changes_is_flat_without_doubt() -> None:
    slope = fit([(HOURS, np.full(len(HOURS), 23.0))], warm_up=0.5)
    assert slope is not None and (slope.per_hour, slope.margin, slope.verdict) == (0.0, 0.0, "flat")


def test_two_processes_at_different_levels_make_no_slope() -> None:
    rng = np.random.default_rng(3)
    series: list[Series] = [(HOURS, level + rng.normal(0.0, 1.0, len(HOURS))) for level in (300.0, 380.0)]
    slope = fit(series, warm_up=0.5)
    assert slope is not None and slope.verdict == "flat" and slope.hours == pytest.approx(15.0)


def test_what_is_taken_in_the_warm_up_is_no_slope() -> None:
    values = 300.0 + 50.0 * np.minimum(HOURS / 0.5, 1.0) + np.random.default_rng(4).normal(0.0, 1.0, len(HOURS))
    after, whole = (fit([(HOURS, values)], warm_up) for warm_up in (0.5, 0.0))
    assert after is not None and after.verdict == "flat" and abs(after.per_hour) < 0.1
    assert whole is not None and whole.per_hour > 1.0


def test_too_few_samples_tell_nothing() -> None:
    assert fit([(HOURS[:2], np.array([1.0, 2.0]))], warm_up=0.0).verdict == "unknown"  # type: ignore[union-attr]
    assert fit([(HOURS[:1], np.array([1.0]))], warm_up=0.0) is None


def test_an_open_file_and_a_thread_are_counted_and_so_is_memory() -> None:
    before = resources(os.getpid())
    wait = threading.Event()
    thread = threading.Thread(target=wait.wait)
    with open(os.devnull):
        thread.start()
        held = mmap.mmap(-1, 30_000_000, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS)  # new memory, not what was free
        held.write(bytes(len(held)))
        now = resources(os.getpid())
        wait.set()
        thread.join()
    assert now[FILES] == before[FILES] + 1 and now[THREADS] == before[THREADS] + 1
    assert now[MEMORY] - before[MEMORY] == pytest.approx(len(held) / 2**20, abs=3.0)


def test_a_file_in_shared_memory_that_nobody_has_open_is_counted_with_its_locks() -> None:
    names = [f"soak_test_{uuid.uuid4().hex}{ending}" for ending in ("", "_el")]
    paths = [SHARED_MEMORY / name for name in names]
    try:
        for path in paths:
            path.write_bytes(b"x")
        with_them = shared_memory_files([os.getpid()])
        for path in paths:
            path.unlink()
        assert with_them >= 2 and not any(path.exists() for path in paths)
    finally:
        for path in paths:
            path.unlink(missing_ok=True)


def test_a_line_that_was_cut_off_is_left_out(tmp_path: Path) -> None:
    file = samples.new_segment(tmp_path, "lockstep")
    samples.add(file, {SIMULATED: 60.0})
    with open(file, "a") as out:
        out.write('{"simulated [s]": 12')
    (segment,) = samples.read(tmp_path, "lockstep")
    assert segment.samples == [{SIMULATED: 60.0}] and segment.duration == 60.0
    assert samples.read(tmp_path, "graph") == []


def sample(simulated: float, memory: float) -> Sample:
    figures = {FILES: 6.0, THREADS: 4.0, lockstep.SHARED: 0, lockstep.OBJECTS: 3e5}
    return (
        {SIMULATED: simulated, lockstep.SEED: 1, MEMORY: memory}
        | figures
        | {lockstep.PROCESSOR: 1.2, lockstep.WALL: 1.3}
    )


def test_chunks_of_two_processes_are_put_together_and_told_in_a_table(tmp_path: Path) -> None:
    ended = {"result": "1 : 0", "trials": 10, "goals": 9, "falls": 0, "removals": 0}
    for name, level in (("lockstep_a", 300.0), ("lockstep_b", 350.0)):
        rng = np.random.default_rng(5)
        lines = [sample(60.0 * minute, level + rng.normal()) for minute in range(1, 91)]
        lines[-1][lockstep.ENDED] = ended
        (tmp_path / f"{name}.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    trials = soak.choose({"hours": "3", "minutes": "0", "folder": str(tmp_path)})
    rows = [soak.measure(*trial) for trial in trials]  # all of it is there already: nothing is played
    assert [sum(map(len, row["segments"].values())) for row in rows] == [15] * 12
    text = "\n".join(soak.summarize(rows))
    assert "3.00 hours in 2 processes, 2 whole matches with 20 trials, 18 goals, 0 falls, 0 removals" in text
    assert "| open files | 6 | 6 | 6 | +0 ± 0 | +0 | flat |" in text
    (memory,) = (line for line in text.splitlines() if line.startswith(f"| {MEMORY}"))
    assert memory.endswith("| flat |") and float(memory.split("|")[2]) == pytest.approx(325.0, abs=0.5)


def test_nodes_of_a_graph_are_told_one_by_one() -> None:
    lines = []
    for index in range(90):
        nodes = {"driver": {MEMORY: 200.0 + 0.1 * index}, "striker/head": {MEMORY: 80.0, graph.SERVICE: 0.15}}
        whole = {graph.SHARED: 40, graph.FACTOR: 0.5, graph.PICTURE: 12.0}
        lines.append({SIMULATED: 20.0 * (index + 1), "whole": whole, "nodes": nodes, "events": []})
    text = "\n".join(soak.summarize([{"mode": "graph", "hours": 0.5, "segments": {"graph_a": lines}}]))
    assert "30.0 minutes" in text and "Processes that ended meanwhile: 0" in text
    (driver,) = (line for line in text.splitlines() if line.startswith("| driver |"))
    assert "| 205.2; +18 ± " in driver and "grows" in driver  # 0.1 MB in 20 s
    (head,) = (line for line in text.splitlines() if line.startswith("| striker/head |"))
    assert "| 80; +0 ± 0, flat |" in head and "| 0.15; +0 ± 0, flat |" in head


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"hour": "8"}, "expected some of hours"),
        ({"eyes": "x"}, "camera"),
        ({"hours": "-1"}, "0 to 1000"),
        ({"hours": "0", "minutes": "0"}, "nothing to play"),
    ],
)
def test_unknown_options_are_refused(options: dict[str, str], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        soak.choose(options)


@pytest.mark.sim
def test_matches_follow_each_other_in_one_process_until_the_time_is_played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(lockstep, "PERIOD", 1.0)
    robot = RobotSettings(perception=PerceptionParameters.ideal())
    times = {f"{name}_time": 0.4 for name in ("initial", "ready", "set", "playing", "finished")}
    settings = MatchSettings(rules=MatchRules(trials=1, extra_pairs=0, **times), robots=(robot, robot))
    lockstep.play_until(tmp_path, 2.5, settings)
    (first,) = samples.read(tmp_path, lockstep.MODE)
    seeds = [each[lockstep.SEED] for each in first.samples if lockstep.ENDED in each]
    assert first.duration >= 2.5 and seeds == list(range(1, len(seeds) + 1)) and len(seeds) >= 1
    lockstep.play_until(tmp_path, first.duration + 0.1, settings)  # goes on with the next match
    (both,) = samples.read(tmp_path, lockstep.MODE)
    played = [each[SIMULATED] for each in both.samples]
    assert played == sorted(played) and both.samples[: len(first.samples)] == first.samples
    assert both.samples[-1][lockstep.SEED] == len(seeds) + 1
    costs = [each[lockstep.PROCESSOR] for each in both.samples if lockstep.PROCESSOR in each]
    assert min(costs) > 0.0 and len(costs) >= int(both.duration / 2.0)  # whatever matches end between
