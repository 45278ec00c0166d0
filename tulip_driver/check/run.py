"""All checks in their order: first those that move nothing, those after which the robot is limp at the end."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from tulip_description.robot import Robot
from tulip_driver.check.joints import check_joints
from tulip_driver.check.readings import check_readings
from tulip_driver.check.rig import Rig, SilentError
from tulip_driver.check.rows import Row, judged
from tulip_driver.check.safety import check_garbage, check_limits, check_limp, check_silence, check_stop, not_moved
from tulip_driver.contract import Body, BodyError
from tulip_driver.guard import GuardParameters
from tulip_driver.loading import flag


def check_driver(
    body: Body,
    robot: Robot,
    may_move: Callable[[], bool],
    parameters: GuardParameters | None = None,
) -> Iterator[Row]:
    """Check a body and yield the lines of the table as they come. The body is stopped at the end in any case.

    Args:
        body: Under test; the robot hangs or stands in the posture that it shall hold.
        robot: What it should be like.
        may_move: Asked before the first joint moves.
        parameters: Of the guard.

    Raises:
        BodyError: if the body cannot be started.
    """
    rig = Rig(body, robot, parameters or GuardParameters())
    rig.loop.start()
    try:
        yield from check_readings(rig)
        if not flag(body, "moves"):
            yield from not_moved("the body cannot be moved")
        elif not rig.loop.sensors or not may_move():
            yield from not_moved("the robot shall not move")
        else:
            home = rig.loop.sensors.joint_positions
            yield from check_joints(rig, home)
            yield from check_garbage(rig, home)
            yield from check_limits(rig, home)
            yield from check_limp(rig, home)
            yield from check_silence(rig)
        yield from check_stop(rig)
    except SilentError:
        yield judged("readings", "the body fell silent for a second", "they go on", False)
    except BodyError as error:
        yield judged("readings", f"the body was lost: {error}", "they go on", False)
    finally:
        rig.loop.stop()
