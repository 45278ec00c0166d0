"""The hip strategy: where the ankles are at their end, the torso turns so that the feet stay flat.

The ground acts at the ZMP, which lies in the soles. What moves the CoM is the centroidal moment pivot (CMP), and the
two part where the body's angular momentum L changes: with a vertical force f, zmp - cmp = (-dLy/dt, dLx/dt) / f. A
swinging leg does that unasked; a torso that turns does it for a purpose (Popovic, Goswami and Herr, "Ground reference
points in legged locomotion", 2005). So the CMP may be asked for beyond the soles, and the torso gives up as much of its
upright attitude as brings the ZMP back into them.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tulip_motion.stabilizer import SupportArea


def turn_for_balance(wrench: NDArray[np.float64], area: SupportArea) -> tuple[float, float]:
    """Return what to add to the torso's angular acceleration about odom's x and y [rad/s^2]; (0, 0) if nothing.

    No more is added than what would bring the torso to a lean of `max_lean` instead of upright.

    Args:
        wrench: (6,) force and moment about odom's origin that the planned motion asks of the ground [N], [N m].
        area: Where the ZMP can be.
    """
    p = area.parameters
    _, _, force, moment_x, moment_y, _ = wrench.tolist()
    if force < p.contact_force:
        return 0.0, 0.0  # as good as in the air, where a ZMP means nothing
    zmp = (-moment_y / force, moment_x / force)
    nearest, _ = area.nearest(zmp)
    per_metre = force / p.torso_inertia
    most = p.torso_stiffness * p.max_lean
    about_x, about_y = (nearest[1] - zmp[1]) * per_metre, (zmp[0] - nearest[0]) * per_metre
    return min(max(about_x, -most), most), min(max(about_y, -most), most)
