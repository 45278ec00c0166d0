"""SDF as libsdformat, Gazebo's own parser, takes it (inside the library drake), or else as plain numbers."""

from __future__ import annotations

import logging
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from tulip_description.export.parts import FIELD
from tulip_sim.export_check.figures import BodyFigures, Figures, JointFigures

UNUSED = "Ignoring unsupported SDFormat element"
"""What Drake says of elements that are good SDF and that it has no use for, like sensors. All else is a fault."""


class SdfError(ValueError):
    """A file is not what the SDF specification says; the message is the parser's."""


def sdf_figures(path: Path) -> Figures:
    """Return the figures of the models in a file, parsed by libsdformat and checked against its specification.

    Raises:
        ModuleNotFoundError: without the library drake (extra `sdf`).
        SdfError: if the parser finds a fault.
    """
    from pydrake.multibody.parsing import Parser
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import BodyIndex

    plant, heard = MultibodyPlant(time_step=0.001), _Heard()
    log = logging.getLogger("drake")
    handlers, log.handlers, propagates, log.propagate = log.handlers, [heard], log.propagate, False
    try:
        Parser(plant).AddModels(path)
    except RuntimeError as error:
        raise SdfError(f"{path}: {error}") from error
    finally:
        log.handlers, log.propagate = handlers, propagates
    faults = [words for words in heard.words if UNUSED not in words]
    if faults:
        raise SdfError(f"{path}: {'; '.join(faults)}")
    plant.Finalize()
    bodies, joints = {}, {}
    for index in range(1, plant.num_bodies()):
        body = plant.get_body(BodyIndex(index))
        if body.name() == FIELD:  # which does not move and has no mass
            continue
        spatial = body.default_spatial_inertia()
        com, mass = spatial.get_com(), spatial.get_mass()
        about_origin = spatial.CalcRotationalInertia().CopyToFullMatrix3()
        about_com = about_origin - mass * (com @ com * np.eye(3) - np.outer(com, com))
        bodies[body.name()] = BodyFigures(mass, com, about_com)
    efforts = {
        plant.get_joint_actuator(index).joint().name(): plant.get_joint_actuator(index).effort_limit()
        for index in plant.GetJointActuatorIndices()
    }
    for index in plant.GetJointIndices():
        joint = plant.get_joint(index)
        if joint.type_name() == "revolute":
            place = joint.frame_on_parent().GetFixedPoseInBodyFrame().translation()
            joints[joint.name()] = JointFigures(
                place,
                joint.revolute_axis(),
                float(joint.position_lower_limits()[0]),
                float(joint.position_upper_limits()[0]),
                float(efforts[joint.name()]),
                float(joint.velocity_upper_limits()[0]),
                float(joint.default_damping()),
            )
    return Figures(bodies, joints)


class _Heard(logging.Handler):
    """Collects what a library logs."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.words: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.words.append(record.getMessage())


def plain_sdf_figures(path: Path) -> Figures:
    """Return the figures of the models in a file by our own reading, without any check of its form."""
    bodies, joints = {}, {}
    for model in ElementTree.parse(path).getroot().iter("model"):
        for link in model.findall("link") if model.get("name") != FIELD else ():
            moments = {entry.tag: float(entry.text or "nan") for entry in link.findall("inertial/inertia/*")}
            tensor = np.array([[moments[f"i{min(a, b)}{max(a, b)}"] for b in "xyz"] for a in "xyz"])
            com = _row(link, "inertial/pose")[:3]
            bodies[str(link.get("name"))] = BodyFigures(float(_row(link, "inertial/mass")[0]), com, tensor)
        for joint in model.findall("joint[@type='revolute']"):
            numbers = [float(_row(joint, f"axis/limit/{name}")[0]) for name in ("lower", "upper", "effort", "velocity")]
            dynamics = [float(_row(joint, f"axis/dynamics/{name}")[0]) for name in ("damping", "friction")]
            place, axis = _row(joint, "pose")[:3], _row(joint, "axis/xyz")
            joints[str(joint.get("name"))] = JointFigures(place, axis, *numbers, *dynamics)
    return Figures(bodies, joints)


def _row(element: ElementTree.Element, path: str) -> np.ndarray:
    return np.array([float(word) for word in (element.findtext(path) or "").split()])
