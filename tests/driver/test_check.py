"""The test kit: good bodies pass, and each kind of bad one fails in the line that names its fault."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bodies import ROBOT, VirtualBody

from tulip_description.field import load_field
from tulip_description.robot import JOINTS
from tulip_description.robot_io import Battery, JointCommand, Sensors
from tulip_driver.check.rows import Judgement, Row, verdict
from tulip_driver.check.run import check_driver
from tulip_driver.contract import Body, BodyError
from tulip_driver.log_body import LogBody
from tulip_sim.lockstep import Lockstep
from tulip_sim.lockstep_recording import LockstepRecording
from tulip_sim.parameters import ENGINES
from tulip_sim.scenario import make_scenario
from tulip_sim.simulated_body import SimulatedBody

KNEE = JOINTS.index("left_knee")


def rows_of(body: Body, may_move: bool = True) -> list[Row]:
    return list(check_driver(body, ROBOT, lambda: may_move))


def failed(body: Body, may_move: bool = True) -> set[str]:
    return {row.what for row in rows_of(body, may_move) if row.judgement is Judgement.FAIL}


class Changed(VirtualBody):
    """Its readings are changed by a function of the reading and their number."""

    def __init__(self, change: Any) -> None:
        super().__init__()
        self._change, self._count = change, 0

    def exchange(self, command: JointCommand | None) -> Sensors:
        self._count += 1
        return self._change(super().exchange(command), self._count)


def test_the_echo_body_passes_every_check() -> None:
    rows = rows_of(VirtualBody())
    assert verdict(rows)[0], [row for row in rows if row.judgement is Judgement.FAIL]
    assert {row.what for row in rows} >= {*JOINTS, "limp: stiffness gone", "silence: legs damped", "garbage: NaN"}


@pytest.mark.sim
@pytest.mark.parametrize("engine", ENGINES)
def test_the_simulated_robot_in_its_harness_passes_every_check(engine: str) -> None:
    if engine == "mujoco":
        pytest.importorskip("mujoco", reason="MuJoCo is not installed (extra mujoco)")
    rows = rows_of(SimulatedBody(ROBOT, harness=True, engine=engine))
    assert verdict(rows)[0], [row for row in rows if row.judgement is Judgement.FAIL]


@pytest.mark.sim
def test_a_recording_passes_what_can_be_asked_of_it(tmp_path: Path) -> None:
    recording = LockstepRecording(tmp_path / "log")
    trial = Lockstep(make_scenario("open", np.random.default_rng(1), load_field()), 1, listener=recording.write)
    while trial.stamp < 2.2e9:
        trial.step()
    trial.close()
    recording.close()
    rows = rows_of(LogBody(ROBOT, str(tmp_path / "log")))
    assert verdict(rows)[0], rows
    assert [row.what for row in rows if row.judgement is Judgement.SKIPPED][-1].startswith("joints")


def in_degrees(reading: Sensors, _: int) -> Sensors:
    return replace(reading, joint_positions=np.degrees(reading.joint_positions))


def knee_reversed(reading: Sensors, _: int) -> Sensors:
    velocity = reading.joint_velocities.copy()
    velocity[KNEE] *= -1.0
    return replace(reading, joint_velocities=velocity)


def knees_swapped(reading: Sensors, _: int) -> Sensors:
    order = list(range(14))
    other = JOINTS.index("right_knee")
    order[KNEE], order[other] = other, KNEE
    return replace(reading, joint_positions=reading.joint_positions[order])


def upside_down(reading: Sensors, _: int) -> Sensors:
    return replace(reading, imu_linear_acceleration=-reading.imu_linear_acceleration)


def no_attitude(reading: Sensors, _: int) -> Sensors:
    return replace(reading, imu_orientation=np.zeros(4))


def in_kilograms(reading: Sensors, _: int) -> Sensors:
    return replace(reading, foot_cells=reading.foot_cells * -0.1 - 20.0)


def every_second(reading: Sensors, count: int) -> Sensors:
    return replace(reading, stamp=reading.stamp - count % 2 * 4_000_000)


def jumping(reading: Sensors, count: int) -> Sensors:
    return replace(reading, stamp=reading.stamp - 20_000_000 * (count % 50 == 49))


def with_nan(reading: Sensors, count: int) -> Sensors:
    return replace(reading, joint_efforts=np.full(14, np.nan)) if count % 100 == 0 else reading


def empty(reading: Sensors, _: int) -> Sensors:
    return replace(reading, battery=Battery(1.2), joint_temperatures=np.full(14, 300.0))


@pytest.mark.parametrize(
    ("change", "lines"),
    [
        (in_degrees, {"joint ranges"}),
        (upside_down, {"IMU acceleration, levelled"}),
        (no_attitude, {"IMU orientation"}),
        (in_kilograms, {"foot cells"}),
        (every_second, {"rate"}),
        (jumping, {"stamps grow"}),
        (with_nan, {"readings"}),
        (empty, {"battery", "temperatures"}),
    ],
)
def test_a_fault_of_the_readings_fails_the_line_that_names_it_before_anything_moves(
    change: Any, lines: set[str]
) -> None:
    assert failed(Changed(change), may_move=False) >= lines


@pytest.mark.parametrize(
    ("change", "lines"), [(knee_reversed, {"left_knee"}), (knees_swapped, {"left_knee", "right_knee"})]
)
def test_joints_that_are_reversed_or_swapped_fail_alone(change: Any, lines: set[str]) -> None:
    assert failed(Changed(change)) == lines


def test_torque_that_stays_after_limp_fails() -> None:
    def stuck(reading: Sensors, _: int) -> Sensors:
        return replace(reading, joint_efforts=np.full(14, 4.0))

    assert "limp: torque gone, measured" in failed(Changed(stuck))


def test_no_command_of_the_kit_reaches_the_body_far_from_where_its_joints_are() -> None:
    class Sinking(VirtualBody):
        """Its joints sink to zero whenever nobody holds them."""

        far = 0.0

        def exchange(self, command: JointCommand | None) -> Sensors:
            if command is None:
                self._position *= 0.99
            elif command.stiffness.any():
                index = [JOINTS.index(name) for name in command.names]
                self.far = max(self.far, float(np.abs(command.position - self._position[index]).max()))
            return super().exchange(command)

    body = Sinking()
    rows_of(body)
    assert 0.0 < body.far < 0.01


def test_a_stop_that_works_once_alone_fails() -> None:
    class Once(VirtualBody):
        stops = 0

        def stop(self) -> None:
            self.stops += 1
            if self.stops == 2:
                raise OSError("port is closed")

    (row,) = (row for row in rows_of(Once(), may_move=False) if row.judgement is Judgement.FAIL)
    assert (row.what, row.measured) == ("stop, twice", "OSError: port is closed")


def test_a_body_that_falls_silent_fails_and_is_stopped() -> None:
    class Silent(Changed):
        stopped = False

        def stop(self) -> None:
            self.stopped = True

    first: list[Sensors] = []

    def freeze(reading: Sensors, count: int) -> Sensors:
        first.append(reading)
        return first[min(count, 1000) - 1]

    body = Silent(freeze)
    rows = rows_of(body)
    assert rows[-1].measured == "the body fell silent for a second"
    assert rows[-1].judgement is Judgement.FAIL
    assert body.stopped


def test_a_robot_that_may_not_move_is_told_nothing() -> None:
    told: list[JointCommand | None] = []

    class Listening(VirtualBody):
        def exchange(self, command: JointCommand | None) -> Sensors:
            told.append(command)
            return super().exchange(command)

    rows = rows_of(Listening(), may_move=False)
    assert verdict(rows)[0]
    assert set(told) == {None}


def test_a_recording_without_sensors_is_refused_by_the_topics_that_it_lacks() -> None:
    walk = Path(__file__).parents[1] / "data" / "recordings" / "walk"
    with pytest.raises(BodyError, match="lacks /joint_states, /imu, /foot_forces"):
        rows_of(LogBody(ROBOT, str(walk)))
