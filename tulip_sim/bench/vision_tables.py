"""Tables of bench vision: what came out beside what was asked for, errors, and how honest the spreads are."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_sim.bench.runner import Row
from tulip_sim.bench.vision_goals import FARTHEST, GoalCounts
from tulip_sim.bench.vision_score import LINE_LIMITS, Sighting

Array = NDArray[np.float64]

RANGES = {"ball": 8.0, "post": 9.0, "pole": 7.0, "opponent": 8.0, "crossing": 5.0, "mark": 3.0, "circle": 4.0}
"""[m] along the ground, up to which a thing that is seen whole has to be found."""
NEAR_BALL, RANGED_BALL = 6.0, 4.5  # [m]
MOVEMENTS = {"stand": "standing", "walk": "walking", "sweep": "walking, head sweeping"}


def sightings_of(rows: Sequence[Row]) -> list[Sighting]:
    """Return the sightings of all scenes."""
    return [Sighting.from_text(text) for row in rows for text in row["sightings"]]


def figures(rows: Sequence[Row]) -> list[tuple[str, str, str, bool]]:
    """Return what is measured, the bar, the value, and whether it is reached.

    Args:
        rows: Of the scenes.
    """
    all_seen, pictures = sightings_of(rows), sum(row["pictures"] for row in rows)

    def recall(what: str, name: str, bar: float, nearest: float, farthest: float) -> tuple[str, str, str, bool]:
        there = [each for each in _whole(all_seen, name) if nearest <= each.distance <= farthest]
        found = sum(each.found for each in there)
        share = found / max(len(there), 1)
        return what, f"{bar:.2f}", f"{share:.3f} ({found} of {len(there)})", share >= bar

    near = [each for each in _whole(all_seen, "ball") if each.found and each.distance <= RANGES["ball"]]
    standing = [each for each in near if each.movement == "stand"]
    result = [
        recall(f"ball, to {NEAR_BALL:g} m", "ball", 0.97, 0.0, NEAR_BALL),
        recall(f"ball, {NEAR_BALL:g} m to {RANGES['ball']:g} m", "ball", 0.90, NEAR_BALL, RANGES["ball"]),
    ]
    for name in ("azimuth", "elevation"):
        middle, most = _degrees(standing, name)
        value = f"{middle:.3f} deg, {most:.3f} deg"
        result.append(
            (f"ball, {name}, standing: median, 95 %", "0.1 deg, 0.5 deg", value, middle <= 0.1 and most <= 0.5)
        )
    ranged = np.abs([each.range_error for each in near if each.distance < RANGED_BALL])
    median, high = (float(np.percentile(ranged, share)) for share in (50, 95))
    value = f"median {median:.1%}, 95 % {high:.1%}"
    result.append((f"ball, range under {RANGED_BALL:g} m", "5 %", value, high <= 0.05))
    false = sum(each.state == "false" for each in all_seen if each.name == "ball")
    result.append(("false balls", "1 in 1000 pictures", f"{false} in {pictures} pictures", 1000 * false <= pictures))
    for what, name, bar in (
        ("goal posts", "post", 0.98),
        ("opponents", "opponent", 0.97),
        ("crossings, of the right kind", "crossing", 0.95),
        ("poles", "pole", 0.95),
    ):
        result.append(recall(f"{what}, to {RANGES[name]:g} m", name, bar, 0.0, RANGES[name]))
    goals = sum((GoalCounts(**row["goals"]) for row in rows), GoalCounts())
    share = goals.paired / max(goals.there, 1)
    value = f"{share:.3f} ({goals.paired} of {goals.there}); {goals.false} false"
    result.append((f"goals: the two posts of one paired, to {FARTHEST:g} m", "", value, goals.false == 0))
    value = f"{goals.sided} of {goals.posts} have one; {goals.wrong} wrong"
    result.append(("posts: left or right one of its goal", "", value, goals.wrong == 0))
    crossings = [each for each in all_seen if each.name == "crossing" and each.found]
    wrong = sum(each.state == "false" for each in crossings)
    share = wrong / max(len(crossings), 1)
    result.append(("false crossings", "2 %", f"{share:.2%} ({wrong} of {len(crossings)})", share <= 0.02))
    for key, what in (("believed", "camera pose as the robot knew it"), ("own", "true camera pose: vision's own part")):
        counts = np.sum([row[f"line points, {key}"] for row in rows], axis=0)
        share = counts[1] / max(counts[0], 1)
        value = ", ".join(
            f"{count / max(counts[0], 1):.1%} within {100 * limit:g} cm"
            for count, limit in zip(counts[1:], LINE_LIMITS, strict=True)
        )
        result.append((f"line points to 5 m, {what}", "95 % within 2 cm", value, share >= 0.95))
    return result


def scenes_table(rows: Sequence[Row]) -> list[str]:
    """Return the figures of the scenes as markdown.

    Args:
        rows: Of the scenes.
    """
    pictures, seeds = sum(row["pictures"] for row in rows), [row["seed"] for row in rows]
    light = [row["brightness"] for row in rows]
    lines = [
        f"{pictures} pictures of random scenes by {len(rows)} robots (seeds {min(seeds)} to {max(seeds)}), 640 x 480,"
        f" brightness {min(light):.2f} to {max(light):.2f}, exposure 2 to 10 ms rendered millisecond by millisecond:"
        " standing, walking at random, and walking while the head sweeps in search. The camera's pose is the one from"
        " joints, IMU and odometry. Things count that are whole in the picture and that nothing hides.",
        "",
        "| what | asked for | came out | reached |",
        "| --- | --- | --- | --- |",
    ]
    lines += [f"| {what} | {bar} | {value} | {'yes' if ok else 'no'} |" for what, bar, value, ok in figures(rows)]
    lines += [
        "",
        "Errors (median / 95 %) with the camera pose as the robot knew it, and in brackets with the true one, which"
        " leaves what vision itself errs. Honesty: mean of (error / claimed spread)^2, 1 if the spread is exact, and"
        " share within two spreads (0.95 if exact).",
        "",
        "| what | found | false | azimuth [deg] | elevation [deg] | honesty: azimuth | elevation |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    all_seen = sightings_of(rows)
    for name, farthest in RANGES.items():
        here = [each for each in all_seen if each.name == name]
        lines.append(_errors(f"{name}, to {farthest:g} m", here, farthest))
        for movement, words in MOVEMENTS.items():
            lines.append(_errors(f"... {words}", [each for each in here if each.movement == movement], farthest))
    partly = [each for each in all_seen if each.state == "partly" and each.distance <= RANGES["ball"]]
    found = sum(each.found for each in partly)
    lines += ["", f"Balls of which 40 to 90 % are seen: {found} of {len(partly)} found."]
    counts = np.sum([row["border points"] for row in rows], axis=0)
    shares = ", ".join(
        f"{count / max(counts[0], 1):.1%} within {100 * limit:g} cm"
        for count, limit in zip(counts[1:], LINE_LIMITS, strict=True)
    )
    lines += ["", f"Points of the field's border to 5 m ({counts[0]}), camera pose as the robot knew it: {shares}."]
    return lines


def _whole(all_seen: Sequence[Sighting], name: str) -> list[Sighting]:
    return [each for each in all_seen if each.name == name and each.state == "whole"]


def _degrees(found: Sequence[Sighting], name: str) -> tuple[float, float]:
    """Return median and 95th percentile of an error [deg]; NaN where there is none."""
    values = np.degrees(np.abs([getattr(each, name) for each in found]))
    values = values[np.isfinite(values)]
    if not len(values):
        return math.nan, math.nan
    return float(np.median(values)), float(np.percentile(values, 95))


def _honesty(found: Sequence[Sighting], name: str) -> str:
    ratio = np.array([getattr(each, name) / getattr(each, f"{name}_spread") for each in found])
    ratio = ratio[np.isfinite(ratio)]
    if not len(ratio):
        return ""
    return f"{float((ratio**2).mean()):.2f}, {float((np.abs(ratio) < 2.0).mean()):.2f}"


def _errors(what: str, here: Sequence[Sighting], farthest: float) -> str:
    there = [each for each in here if each.state == "whole" and each.distance <= farthest]
    found = [each for each in there if each.found]
    false = sum(each.state == "false" for each in here)
    cells = [f"{len(found)} of {len(there)}", f"{false}"]
    for angle in ("azimuth", "elevation"):
        known, own = _degrees(found, angle), _degrees(found, f"own_{angle}")
        cells.append(f"{known[0]:.3f} / {known[1]:.3f} ({own[0]:.3f} / {own[1]:.3f})")
    cells += [_honesty(found, angle) for angle in ("azimuth", "elevation")]
    return f"| {what} | {' | '.join(cells)} |"
