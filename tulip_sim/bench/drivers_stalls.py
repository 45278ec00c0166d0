"""What it does to a walk when motion control stalls for a moment, by how long commands live."""

from __future__ import annotations

import numpy as np

from tulip_description.planar import Pose2D
from tulip_motion.interface import WalkCommand, WalkMode
from tulip_sim.bench.body import Body
from tulip_sim.parameters import DriverParameters, WorldParameters
from tulip_sim.timing import TICK

START = Pose2D(-30.0, 10.0, 0.0)  # far from goals and ball
WALK = WalkCommand(0, WalkMode.WALK, (0.5, 0.0, 0.0))
TIME = 12_000  # [ms] of walking
EVERY = 600, 1400  # [ms] between two stalls
WAITING = 5  # readings that wait for motion control meanwhile, as on its topic; older ones are lost


def upright_time(life: int, stall: int, seed: int) -> float:
    """Walk at 0.5 m/s with stalls at random moments, about one a second, and return how long the robot stays up [s].

    Args:
        life: Of a command [ms].
        stall: How long motion control does nothing [ms].
        seed: Of robot, sensors and moments.
    """
    rng = np.random.default_rng([seed, stall])
    body = Body(seed, START, world=WorldParameters(driver=DriverParameters(time_to_live=life)))
    body.go(0.3)
    passed, due = 0, int(rng.integers(*EVERY))
    while passed < TIME and not body.fallen:
        if passed >= due:
            body.stall(WALK, stall, WAITING)
            passed += stall
            due = passed + int(rng.integers(*EVERY))
        body.tick(WALK)
        passed += TICK
    return min(passed, TIME) / 1000.0
