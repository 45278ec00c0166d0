"""Follows a recorded walk by PlaCo. Runs in PlaCo's own environment, so it knows nothing of this project.

`python clik_placo.py FOLDER` reads robot.urdf and reference.npz there and writes result.npz.
"""

from __future__ import annotations

import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np


def main(folder: Path) -> None:
    """Replay the walk."""
    import placo

    given = np.load(folder / "reference.npz")
    names, soles = [str(name) for name in given["names"]], [str(name) for name in given["soles"]]
    robot = placo.RobotWrapper(str(folder / "robot.urdf"), placo.Flags.ignore_collisions)
    for name, angle in zip(names, given["start_joints"], strict=True):
        robot.set_joint(name, float(angle))
    robot.set_T_world_fbase(given["start_base"])
    robot.update_kinematics()
    solver = placo.KinematicsSolver(robot)
    solver.dt = float(given["dt"])
    solver.enable_joint_limits(False)
    solver.enable_velocity_limits(False)
    com = solver.add_com_task(given["coms"][0])
    com.configure("com", "soft", 1.0)
    torso = solver.add_orientation_task(str(given["base"]), given["torsos"][0])
    torso.configure("torso", "soft", 1.0)
    feet = [solver.add_frame_task(name, place) for name, place in zip(soles, given["feet"][0], strict=True)]
    solver.add_regularization_task(1e-6)
    standing = None
    seconds, joints, bases = [], [], []
    for stance, com_place, torso_place, places in zip(
        given["stances"], given["coms"], given["torsos"], given["feet"], strict=True
    ):
        begun = time.perf_counter()
        if stance != standing:
            standing = stance
            feet[stance].configure("stance", "hard", 1.0, 1.0)
            feet[1 - stance].configure("other", "soft", 1.0, 1.0)
        com.target_world = com_place
        torso.R_world_frame = torso_place
        for foot, place in zip(feet, places, strict=True):
            foot.T_world_frame = place
        solver.solve(True)
        robot.update_kinematics()
        seconds.append(time.perf_counter() - begun)
        joints.append([robot.get_joint(name) for name in names])
        bases.append(robot.get_T_world_fbase())
    np.savez(folder / "result.npz", seconds=seconds, joints=joints, bases=bases, version=np.array(version("placo")))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
