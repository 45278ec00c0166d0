"""URDF as Pinocchio loads it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin

from tulip_description.export.parts import FIELD
from tulip_sim.export_check.figures import BodyFigures, Figures, JointFigures


def urdf_figures(path: Path, root: str) -> Figures:
    """Return the figures of a floating URDF; links on fixed joints are part of the links that carry them.

    Args:
        path: The file.
        root: Name of its first link.
    """
    model = pin.buildModelFromUrdf(str(path), pin.JointModelFreeFlyer())
    bodies, joints = {}, {}
    for index in range(1, model.njoints):
        joint, inertia, name = model.joints[index], model.inertias[index], model.names[index]
        body = root
        if index > 1:
            body = _link_at(model, index)
            q, v = joint.idx_q, joint.idx_v
            joints[name] = JointFigures(
                model.jointPlacements[index].translation.copy(),
                np.ravel(joint.createData().S)[3:],
                float(model.lowerPositionLimit[q]),
                float(model.upperPositionLimit[q]),
                float(model.effortLimit[v]),
                float(model.velocityLimit[v]),
                float(model.damping[v]),
                float(model.friction[v]),
                float(model.armature[v]),
            )
        if body != FIELD:  # which does not move and has no mass
            bodies[body] = BodyFigures(float(inertia.mass), inertia.lever.copy(), inertia.inertia.copy())
    return Figures(bodies, joints)


def _link_at(model: pin.Model, joint: int) -> str:
    """Return the name of the link whose frame lies in a joint."""
    for frame in model.frames:
        if frame.type == pin.FrameType.BODY and frame.parentJoint == joint and frame.placement.isIdentity():
            return str(frame.name)
    raise ValueError(f"no link lies in joint {model.names[joint]}")
