"""A body that nobody told motion control of: the truth that an identification has to find."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tulip_description.robot import Link, Robot, load_robot, realizable_inertia
from tulip_sim.parameters import WorldParameters

UNLISTED = 0.001  # [kg] of a body that is on the robot and not in the team's table


def secret_body(robot: Robot, rng: np.random.Generator, mass_spread: float = 0.2, com_spread: float = 0.02) -> Robot:
    """Return the robot with other masses, CoMs and inertias, and the same kinematics.

    Args:
        robot: As it is believed to be.
        rng: Source of the changes: uniform and independent for each link.
        mass_spread: Greatest change of a link's mass, as a share; its inertia about its CoM changes alike, so the body
            stays one that can be.
        com_spread: Greatest shift of its CoM along each axis [m].

    Raises:
        ValueError: if mass_spread is not in [0, 1) or com_spread is negative.
    """
    if not 0.0 <= mass_spread < 1.0 or com_spread < 0.0:
        raise ValueError(
            f"mass_spread is {mass_spread}, com_spread {com_spread} m; expected 0 <= mass_spread < 1, com_spread >= 0"
        )
    links = []
    for link in robot.links:
        scale = float(rng.uniform(1.0 - mass_spread, 1.0 + mass_spread))
        x, y, z = (np.array(link.com) + rng.uniform(-com_spread, com_spread, 3)).tolist()
        links.append(replace(_scaled(link, scale), com=(x, y, z)))
    return replace(robot, links=tuple(links))


def hidden_truth(robot: Robot, world: WorldParameters, seed: int | None) -> tuple[Robot | None, WorldParameters]:
    """Return the body that a simulated robot really has, or None for that of `robot`, and the world to put it in.

    A secret body is the whole truth about the masses, since an identification is compared with it: the world changes
    them no further.

    Args:
        robot: As it is believed to be.
        world: To put it in.
        seed: Of the secret body; None for none.
    """
    if seed is None:
        return None, world
    return secret_body(robot, np.random.default_rng(seed)), replace(world, mass_spread=0.0)


def table_robot() -> Robot:
    """Return the playing robot as the team's table knows it: 16.74 kg on the same chain.

    What the table does not list, upper body and head, weighs next to nothing; `load_robot()` is the truth beside it.
    """
    listed = {link.name for link in load_robot("table").links}
    links = [link if link.name in listed else _scaled(link, UNLISTED / link.mass) for link in load_robot().links]
    return replace(load_robot(), links=tuple(links))


def _scaled(link: Link, scale: float) -> Link:
    x, y, z = realizable_inertia(link.inertia)
    return replace(link, mass=link.mass * scale, inertia=(x * scale, y * scale, z * scale))
