"""What protects the robot: limits, garbage, silence, limp, stop."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import replace
from functools import partial
from textwrap import shorten

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import HEAD_JOINTS, LEG_JOINTS
from tulip_description.robot_io import JointCommand
from tulip_driver.check.rig import Rig
from tulip_driver.check.rows import Row, judged, skipped
from tulip_driver.contract import BodyError
from tulip_driver.guard import MILLISECOND
from tulip_driver.parts import by_parts

Array = NDArray[np.float64]
DAMPED_WITHIN = 10.0  # [ms] after a command to the legs has lived: 50 ms after the last one
THEN_WITHIN = 50.0  # [ms] the same for the head, and for what comes later
GONE_WITHIN = 50.0  # [ms] after the request
LIMP_WITHIN = 20.0  # [ms] after the request
WRONG = 0.05  # [rad] off: no harm, should such a command be obeyed after all
STILL = 0.02  # [rad] that garbage may move a joint
ENDS = 1000  # [ms] in which a wanted position gets from one end of the slowest joint's range to the other
FREE = 0.02  # share of its greatest torque that a limp joint may still show


def check_garbage(rig: Rig, home: Array) -> Iterator[Row]:
    """Yield a line for each kind of command that must change nothing."""
    wrong: dict[str, Callable[[JointCommand], JointCommand]] = {
        "NaN": lambda good: replace(good, position=np.full(len(good.names), np.nan)),
        "infinite torque": lambda good: replace(good, effort=np.full(len(good.names), np.inf)),
        "wrong length": lambda good: replace(good, velocity=np.zeros(len(good.names) + 1)),
        "unknown joint": lambda good: replace(good, names=("tail", *good.names[1:])),
        "joint twice": lambda good: replace(good, names=(good.names[1], *good.names[1:])),
        "negative stiffness": lambda good: replace(good, stiffness=-good.stiffness),
        "stale sequence": lambda good: replace(good, sequence=1, position=good.position + WRONG),
        "answer to old sensors": lambda good: replace(good, stamp=good.stamp - 10**9, position=good.position + WRONG),
    }
    for what, spoil in wrong.items():
        yield from rig.undisturbed(partial(_check_wrong, rig, home, what, spoil))


def _check_wrong(rig: Rig, home: Array, what: str, spoil: Callable[[JointCommand], JointCommand]) -> Iterator[Row]:
    start = rig.hold(0.1, lambda _: home)[-1].joint_positions
    bad = [spoil(order) for order in rig.order(home)]
    reasons = [rig.loop.accept(each) for each in bad]
    after = rig.hold(0.1, lambda _: home)
    moved = max(float(np.abs(reading.joint_positions - start).max()) for reading in after)
    told = all(np.isfinite(_values(order)).all() for _, order in rig.probe.told)
    words = f"{'refused' if all(reasons) else 'taken'}, moved {moved:.3f} rad: {shorten(reasons[0], 60)}"
    yield judged(f"garbage: {what}", words, "refused, nothing moves", all(reasons) and told and moved < STILL)


def check_limits(rig: Rig, home: Array) -> Iterator[Row]:
    """Yield the lines about ranges, speeds and torques. The body itself is told nothing meanwhile."""
    rig.begin()
    rig.probe.muted = True
    lower, upper = rig.robot.position_limits
    for far in (upper + 1.0, lower - 1.0):
        begin = rig.loop.now
        while rig.loop.now - begin < ENDS * MILLISECOND:
            rig.command(far, 10.0 * rig.robot.effort_limits, velocity=10.0 * rig.robot.velocity_limits)
            rig.tick()
    # The last wanted positions are far from where the joints are: forget them before the body hears anything again.
    rig.loop.limp("its limits were checked")
    rig.loop.release()
    rig.probe.muted = False
    told = [(at, dict(zip(order.names, range(len(order.names)), strict=True)), order) for at, order in rig.probe.told]
    names = [name for name in rig.robot.joint_names if all(name in places for _, places, _ in told)]
    own = [rig.robot.joint_names.index(name) for name in names]

    def column(kind: str) -> Array:
        return np.array([[getattr(order, kind)[places[name]] for name in names] for _, places, order in told])

    position, times = column("position"), np.array([at for at, _, _ in told]) * 1e-9
    beyond = float(max((lower[own] - position).max(), (position - upper[own]).max()))
    short = float(np.maximum(upper[own] - position.max(axis=0), position.min(axis=0) - lower[own]).max())
    yield judged(
        "limit: range",
        f"{len(names)} joints, at most {beyond:.3f} rad beyond their ends, which they miss by {short:.3f} rad",
        "0 beyond, 0.01 rad short",
        beyond <= 1e-9 and short < 0.01,
    )
    speed = (
        np.abs(np.diff(position, axis=0)) / np.maximum(np.diff(times), 1e-9)[:, None] / rig.robot.velocity_limits[own]
    )
    # A position means nothing without stiffness, as after a pause of the computer in which commands grew old.
    held = column("stiffness") > 0.0
    speed = np.where(held[1:] & held[:-1], speed, 0.0)
    yield judged("limit: rate", f"{speed.max():.2f} of the greatest speed", "1", bool(speed.max() < 1.001))
    velocity = float((np.abs(column("velocity")) / rig.robot.velocity_limits[own]).max())
    yield judged("limit: velocity", f"{velocity:.2f} of the greatest", "1", velocity < 1.001)
    rig.ease(home)  # it may have sunk meanwhile, as nobody commanded it


def check_limp(rig: Rig, home: Array) -> Iterator[Row]:
    """Yield the lines about a request to go limp, and its release."""
    rig.hold(0.3, lambda _: home)
    begin = rig.loop.now
    rig.loop.limp("driver check")
    readings = rig.wait(0.2)
    told = [(at - begin) / MILLISECOND for at, order in rig.probe.told if not _values(order, "stiffness").any()]
    first = min(told, default=float("inf"))
    yield judged("limp: stiffness gone", f"after {first:.1f} ms", f"{LIMP_WITHIN:.0f} ms", first <= LIMP_WITHIN)
    limits = FREE * rig.robot.effort_limits
    still = [
        (arrival - begin) / MILLISECOND
        for arrival, reading in zip(rig.arrivals, readings, strict=True)
        if (np.abs(reading.joint_efforts) > limits).any()
    ]
    last = max(still, default=0.0)
    yield judged("limp: torque gone, measured", f"after {last:.1f} ms", f"{GONE_WITHIN:.0f} ms", last <= GONE_WITHIN)
    refused = rig.command(home)
    yield judged("limp: lasts", f"command {'refused' if refused else 'taken'}", "refused", bool(refused))
    rig.loop.release()
    rig.tick()
    assert rig.loop.sensors is not None
    taken = rig.command(rig.loop.sensors.joint_positions)
    yield judged("limp: release", f"command {taken or 'taken'}", "taken", not taken)


def check_silence(rig: Rig) -> Iterator[Row]:
    """Yield the lines about commands that stop to come."""
    yield from rig.undisturbed(partial(_check_silence, rig))


def _check_silence(rig: Rig) -> Iterator[Row]:
    assert rig.loop.sensors is not None
    present = rig.loop.sensors.joint_positions
    rig.hold(0.3, lambda _: present)
    begin, p = rig.loop.now, rig.parameters
    rig.command(present)
    rig.wait((p.time_to_live + p.head_time_to_live + p.damping_time + 200) * 1e-3)
    for part, joints, life in (("legs", LEG_JOINTS, p.time_to_live), ("head", HEAD_JOINTS, p.head_time_to_live)):
        told = [((at - begin) / MILLISECOND, own) for at, order in rig.probe.told if (own := _part(order, joints))]
        damped = min((age for age, own in told if not _values(own, "stiffness").any()), default=float("inf"))
        limp = min((age for age, own in told if not _values(own, "stiffness", "damping").any()), default=float("inf"))
        for what, age, due in (("damped", damped, life), ("limp", limp, life + p.damping_time)):
            late = DAMPED_WITHIN if (part, what) == ("legs", "damped") else THEN_WITHIN
            expected = f"{due} ms, within {late:.0f} ms"
            in_time = due - 1e-6 <= age <= due + late
            yield judged(f"silence: {part} {what}", f"after {age:.0f} ms", expected, in_time)


def _part(order: JointCommand, joints: Collection[str]) -> JointCommand | None:
    """Return what an order says to some joints; None if nothing."""
    return next((part for part in by_parts(order) if set(part.names) <= set(joints)), None)


def check_stop(rig: Rig) -> Iterator[Row]:
    """Yield the lines about the end, and a new start."""
    try:
        rig.loop.stop()
        rig.loop.stop()
        error = ""
    except Exception as failure:  # anybody's code may raise anything, and the robot must still come to a stop
        error = f"{type(failure).__name__}: {failure}"
    yield judged("stop, twice", error or "done", "no error", not error)
    try:
        rig.loop.start()
        rig.begin()
        came = len(rig.wait_for_reading())
        yield judged("start again", f"{came} reading", "a reading", came > 0)
    except BodyError as failure:
        yield judged("start again", str(failure), "a reading", False)
    finally:
        rig.loop.stop()


def not_moved(why: str) -> Iterator[Row]:
    """Yield the line in place of all checks that move a body."""
    yield skipped("joints, limits, garbage, limp, silence", why)


def _values(order: JointCommand, *kinds: str) -> Array:
    kinds = kinds or ("position", "velocity", "effort", "stiffness", "damping")
    return np.concatenate([getattr(order, kind) for kind in kinds])
