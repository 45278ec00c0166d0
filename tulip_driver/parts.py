"""A body's command, part by part: legs and head each have a time-out of their own."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from tulip_description.robot import HEAD_JOINTS, LEG_JOINTS
from tulip_description.robot_io import JointCommand

VALUES = ("position", "velocity", "effort", "stiffness", "damping")


def by_parts(command: JointCommand) -> Iterator[JointCommand]:
    """Yield what a command says to the legs, and to the head."""
    for part in (LEG_JOINTS, HEAD_JOINTS):
        own = [place for place, name in enumerate(command.names) if name in part]
        if own:
            values = {name: getattr(command, name)[own] for name in VALUES}
            yield replace(command, names=tuple(command.names[place] for place in own), **values)


def limp_command(names: tuple[str, ...], sequence: int, stamp: int) -> JointCommand:
    """Return the command that takes all torque from joints."""
    zero = np.zeros(len(names))
    return JointCommand(sequence, stamp, names, zero, zero, zero, zero, zero)
