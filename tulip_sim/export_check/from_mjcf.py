"""MJCF as MuJoCo loads it."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np

from tulip_description.quaternion import quaternion_matrix
from tulip_sim.export_check.figures import BodyFigures, Figures, JointFigures
from tulip_sim.mujoco_physics import XYZW


def mjcf_figures(path: Path) -> Figures:
    """Return the figures of all bodies but the ground, and of all joints that turn.

    Raises:
        ValueError: if MuJoCo does not take the file.
    """
    model = mujoco.MjModel.from_xml_path(str(path))
    bodies, joints = {}, {}
    for index in range(1, model.nbody):
        body = model.body(index)
        turn = quaternion_matrix(body.iquat[XYZW].tolist())
        bodies[body.name] = BodyFigures(float(body.mass[0]), body.ipos.copy(), turn @ np.diag(body.inertia) @ turn.T)
    limits = {model.joint(int(motor[0])).name: high for motor, (_, high) in zip(
        model.actuator_trnid, model.actuator_ctrlrange, strict=True
    )}  # fmt: skip
    for index in range(model.njnt):
        joint = model.joint(index)
        if joint.type[0] == mujoco.mjtJoint.mjJNT_HINGE:
            joints[joint.name] = JointFigures(
                model.body(int(joint.bodyid[0])).pos + joint.pos,
                joint.axis.copy(),
                float(joint.range[0]),
                float(joint.range[1]),
                float(limits[joint.name]),
                float(model.numeric(f"{joint.name}_velocity_limit").data[0]),
                float(joint.damping[0]),
                float(joint.frictionloss[0]),
                float(joint.armature[0]),
            )
    return Figures(bodies, joints)
