"""Checks that move nothing: readings come in time, and are in the contract's units, signs and frames."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tulip_description.robot import Robot
from tulip_description.robot_io import Sensors
from tulip_driver.check.rig import Rig, SilentError, whole_steps
from tulip_driver.check.rows import Row, judged, skipped
from tulip_driver.contract import PERIOD
from tulip_motion.lipm import GRAVITY

Array = NDArray[np.float64]
LISTEN = 2.0  # [s]
RANGE_SLACK = 0.1  # [rad] beyond a joint's range, for the play of its stop


def check_readings(rig: Rig) -> Iterator[Row]:
    """Yield the lines about readings."""
    yield from rig.undisturbed(lambda: _check_readings(rig))


def _check_readings(rig: Rig) -> Iterator[Row]:
    try:
        readings = rig.wait(LISTEN)
    except SilentError:
        readings = list(rig.readings)
    if rig.loop.faults:
        yield judged("readings", f"{rig.loop.faults} refused: {rig.loop.fault}", "finite, (14,) joints", False)
    if len(readings) < 10:
        yield judged("rate", f"{len(readings)} readings in {LISTEN:g} s", f"{1e9 / PERIOD:.0f} /s", False)
        return
    yield from check_times(readings, rig.late)
    yield judged("stamps grow", f"{rig.probe.went_back} went back", "0", rig.probe.went_back == 0)
    yield from check_units(readings, rig.robot)


def check_times(readings: Sequence[Sensors], late: Sequence[float]) -> Iterator[Row]:
    """Yield the lines about rate and jitter.

    Args:
        readings: In order.
        late: How much later than asked for the computer itself woke up [s]; that is not the body's fault.
    """
    steps = np.diff([reading.stamp for reading in readings]) * 1e-9
    period, excuse = PERIOD * 1e-9, float(np.quantile(late, 0.99)) if late else 0.0
    rate, longest = 1.0 / float(np.median(steps)), float(np.quantile(steps, 0.99))
    yield judged("rate", f"{rate:.1f} /s", f"{1 / period:.0f} /s +- 5%", abs(rate * period - 1.0) < 0.05)
    words = f"99% within {longest * 1e3:.1f} ms" + (f" (computer late by {excuse * 1e3:.1f} ms)" if late else "")
    yield judged("jitter of stamps", words, f"{2e3 * period:.0f} ms", longest <= 2.0 * period + excuse)


def check_units(readings: Sequence[Sensors], robot: Robot) -> Iterator[Row]:
    """Yield the lines about what the readings mean."""
    positions = np.array([reading.joint_positions for reading in readings])
    lower, upper = robot.position_limits
    beyond = np.maximum(lower - positions.min(axis=0), positions.max(axis=0) - upper)
    worst = int(beyond.argmax())
    place = f"{beyond[worst]:.2f} rad beyond" if beyond[worst] > 0.0 else f"{-beyond[worst]:.2f} rad from its end"
    yield judged(
        "joint ranges",
        f"{robot.joint_names[worst]} {place}",
        f"at most {RANGE_SLACK} rad beyond",
        bool(beyond[worst] <= RANGE_SLACK),
    )
    quaternions = np.array([reading.imu_orientation for reading in readings])
    norm = float(np.linalg.norm(quaternions, axis=1).mean())
    yield judged("IMU orientation", f"norm {norm:.3f}", "1 +- 0.01", abs(norm - 1.0) < 0.01)
    if abs(norm - 1.0) < 0.01:
        yield from _check_motion(readings, quaternions)
    cells = np.array([reading.foot_cells for reading in readings])
    weight = robot.mass * GRAVITY
    total = float(np.median(cells.sum(axis=(1, 2))))
    yield judged(
        "foot cells",
        f"{total:.0f} N together, least {cells.min():.0f} N",
        f"-10 N to 1.5 times the weight of {weight:.0f} N",
        bool(cells.min() > -10.0 and total < 1.5 * weight),
    )
    newest = readings[-1]
    if newest.joint_temperatures is None:
        yield skipped("temperatures", "the body measures none")
    else:
        known = newest.joint_temperatures[np.isfinite(newest.joint_temperatures)]
        hottest = float(known.max(initial=-273.0))
        words = f"{len(known)} motors, at most {hottest:.0f} deg C"
        yield judged("temperatures", words, "-20 to 120", bool(((-20.0 < known) & (known < 120.0)).all()))
    if newest.battery is None:
        yield skipped("battery", "the body does not tell")
    else:
        voltage = newest.battery.voltage
        yield judged("battery", f"{voltage:.1f} V", "5 to 100 V", 5.0 < voltage < 100.0)


def _check_motion(readings: Sequence[Sensors], quaternions: Array) -> Iterator[Row]:
    """Yield the lines about acceleration and angular velocity, which an orientation must fit."""
    accelerations = np.array([reading.imu_linear_acceleration for reading in readings])
    force = Rotation.from_quat(quaternions).apply(accelerations).mean(axis=0)
    off = float(np.linalg.norm(force - np.array([0.0, 0.0, GRAVITY])))
    yield judged(
        "IMU acceleration, levelled",
        f"({force[0]:.2f}, {force[1]:.2f}, {force[2]:.2f}) m/s^2",
        "(0, 0, +9.81) +- 1",
        off < 1.0,
    )
    # What the angular velocity in imu_link says must be what the orientation does.
    turned, told = _turns(readings)
    miss = float(np.abs(turned - told).max())
    yield judged("IMU angular velocity", f"differs by {miss:.3f} rad/s on average", "0.1", miss < 0.1)


def _turns(readings: Sequence[Sensors]) -> tuple[Array, Array]:
    """Return (3,) mean angular velocity in imu_link by the orientations, and as measured [rad/s]."""
    steps, whole = whole_steps(readings)
    attitudes = Rotation.from_quat([reading.imu_orientation for reading in readings])
    turns = (attitudes[:-1].inv() * attitudes[1:]).as_rotvec()
    rates = np.array([reading.imu_angular_velocity for reading in readings[1:]])
    seconds = max(float(steps[whole].sum()), PERIOD * 1e-9)
    return turns[whole].sum(axis=0) / seconds, steps[whole] @ rates[whole] / seconds
