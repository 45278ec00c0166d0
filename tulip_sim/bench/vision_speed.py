"""How long each stage of vision takes, on one thread, and a nano detection network on the same pictures."""

from __future__ import annotations

import time
from itertools import islice
from typing import Any

import cv2
import numpy as np

from tulip_description.robot import load_robot
from tulip_sim.bench.runner import Row
from tulip_sim.bench.vision_network import Detector
from tulip_sim.bench.vision_shots import Shot, shots
from tulip_vision.lens import head_camera_lens
from tulip_vision.opponents import OpponentParameters
from tulip_vision.own_body import OwnBody
from tulip_vision.pipeline import VisionParameters, stages
from tulip_vision.view import View

SEEDS = (9001, 9002, 9003, 9004)
PICTURES = 10  # of each seed
ROUNDS = 3  # of which the fastest counts: what else the computer does only adds time


def measure_speed() -> Row:
    """Time the stages on pictures like those of the scenes, with the processor time of this thread."""
    cv2.setNumThreads(1)
    lens = head_camera_lens()
    lens.ray_table()
    times: dict[str, list[float]] = {}
    network: list[float] = []
    try:
        detector, missing = Detector(lens.width, lens.height), ""
    except RuntimeError as error:
        detector, missing = None, str(error)
    for seed in SEEDS:
        taken = list(islice(shots(seed), PICTURES))
        parameters = VisionParameters(opponents=OpponentParameters(team_colour=taken[0].camera.team_colour))
        order = stages(parameters, OwnBody(load_robot()))
        for shot in taken:  # the first one fills the tables
            _time(shot, order, lens, parameters)
        for shot in taken:
            rounds = [_time(shot, order, lens, parameters) for _ in range(ROUNDS)]
            for name in rounds[0]:
                times.setdefault(name, []).append(min(each[name] for each in rounds))
            times.setdefault("all stages", []).append(min(sum(each.values()) for each in rounds))
            if detector is not None:
                network.append(min(_time_network(shot, detector) for _ in range(ROUNDS)))
    return {
        "network": {"missing": missing}
        if detector is None
        else {
            "GFLOP": round(detector.network.flops / 1e9, 2),
            "million weights": round(detector.network.weights / 1e6, 2),
            "median [ms]": round(1000.0 * float(np.median(network)), 2),
            "p95 [ms]": round(1000.0 * float(np.percentile(network, 95)), 2),
        },
        "part": "speed",
        "seeds": list(SEEDS),
        "pictures": len(times["all stages"]),
        "size": f"{lens.width} x {lens.height}",
        "median [ms]": {name: round(1000.0 * float(np.median(each)), 3) for name, each in times.items()},
        "p95 [ms]": {name: round(1000.0 * float(np.percentile(each, 95)), 3) for name, each in times.items()},
    }


def _time(shot: Shot, order: Any, lens: Any, parameters: VisionParameters) -> dict[str, float]:
    """Return the time of each stage for one picture [s]."""
    board: dict[str, Any] = {"picture": shot.picture, "view": View(lens, shot.believed, parameters.spread)}
    times = {}
    for stage in order:
        begin = time.thread_time()
        board[stage.provides] = stage.run(*(board[name] for name in stage.requires))
        times[stage.name] = time.thread_time() - begin
    return times


def _time_network(shot: Shot, detector: Detector) -> float:
    """Return the time that the network takes for one picture [s]."""
    begin = time.thread_time()
    detector.run(shot.picture)
    return time.thread_time() - begin


def speed_table(row: Row, bar: float) -> list[str]:
    """Return the figures as markdown.

    Args:
        row: From `measure_speed`.
        bar: Median asked for [ms].
    """
    median, most = row["median [ms]"], row["p95 [ms]"]
    total = median["all stages"]
    lines = [
        "### Speed",
        "",
        f"{row['pictures']} pictures of {row['size']}, one thread, its own processor time, the fastest of {ROUNDS}"
        f" rounds. Asked for: {bar:g} ms median; {'reached' if total <= bar else 'not reached'}.",
        "",
        "| stage | median [ms] | 95 % [ms] |",
        "| --- | --- | --- |",
    ]
    lines += [f"| {name} | {median[name]:.2f} | {most[name]:.2f} |" for name in median]
    network = row["network"]
    if "missing" in network:
        return [*lines, "", f"No network to compare with: {network['missing']}."]
    return [
        *lines,
        f"| a nano network instead | {network['median [ms]']:.2f} | {network['p95 [ms]']:.2f} |",
        "",
        f"The network has the layers of YOLO11n at the same input size ({network['GFLOP']:.1f} GFLOP a picture,"
        f" {network['million weights']:.1f} million weights, random ones: they do not change its time). It runs through"
        " ONNX Runtime on one thread, on the same pictures in the same run, from the picture to boxes and scores; the"
        f" suppression of double boxes is left out. It takes {network['median [ms]'] / total:.1f} times as long as all"
        " stages.",
    ]
