"""How near the legs come to the rest of the body: distances between the robot's boxes, by coal through Pinocchio."""

from __future__ import annotations

from itertools import combinations

import coal
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.robot import LEG_JOINTS, Box, Link, Robot

Array = NDArray[np.float64]


class SelfCollision:
    """Measures the clearance between the robot's parts.

    Only pairs with a part of a leg count: what sits on the trunk keeps its distances. Neighbours in a leg, with one
    joint or one joint with two axes between them, meet in that joint always; its range looks after them.
    """

    def __init__(self, robot: Robot) -> None:
        """Collect the boxes that take part in contacts.

        Args:
            robot: Its shapes and joints.
        """
        self._model = floating_model(robot)
        self._data = self._model.createData()
        self._geometry = pin.GeometryModel()
        for link in robot.links:
            for box in link.boxes:
                if box.collides:
                    self._add(link, box)
        shapes = self._geometry.geometryObjects
        neighbours = _neighbours(robot)
        legs = {joint.child for joint in robot.joints if joint.name in LEG_JOINTS}
        for first, second in combinations(range(len(shapes)), 2):
            names = frozenset((_link_of(shapes[first].name), _link_of(shapes[second].name)))
            if len(names) == 2 and names & legs and names not in neighbours:
                self._geometry.addCollisionPair(pin.CollisionPair(first, second))
        self._geometry_data = self._geometry.createData()
        self._configuration = pin.neutral(self._model)

    def clearance(self, joint_positions: Array) -> tuple[float, str]:
        """Return the smallest distance between two parts [m], 0 or less if they meet, and the two links' names.

        Args:
            joint_positions: (n,) [rad], order of `robot.joint_names`.
        """
        self._configuration[7:] = joint_positions
        pin.updateGeometryPlacements(self._model, self._data, self._geometry, self._geometry_data, self._configuration)
        nearest = int(pin.computeDistances(self._geometry, self._geometry_data))
        pair = self._geometry.collisionPairs[nearest]
        names = (_link_of(self._geometry.geometryObjects[index].name) for index in (pair.first, pair.second))
        return float(self._geometry_data.distanceResults[nearest].min_distance), " and ".join(names)

    def _add(self, link: Link, box: Box) -> None:
        frame = self._model.frames[self._model.getFrameId(link.name)]
        at = frame.placement * pin.SE3(np.eye(3), np.array(box.centre))
        name = f"{link.name}/{self._geometry.ngeoms}"
        self._geometry.addGeometryObject(pin.GeometryObject(name, frame.parentJoint, at, coal.Box(*box.size)))


def _link_of(shape: str) -> str:
    return shape.partition("/")[0]


def _neighbours(robot: Robot) -> set[frozenset[str]]:
    """Return pairs of links with one joint between them, or two whose axes meet in one point."""
    pairs = {frozenset((joint.parent, joint.child)) for joint in robot.joints}
    at = {joint.child: joint for joint in robot.joints}
    for joint in robot.joints:
        above = at.get(joint.parent)
        if above is not None and not any(joint.origin):
            pairs.add(frozenset((above.parent, joint.child)))
    return pairs
