"""The simulator as a body: the world advances by one control tick with each exchange."""

from __future__ import annotations

import numpy as np

from tulip_description.field import load_field
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.contract import Body, BodyError
from tulip_driver.parts import by_parts
from tulip_sim.harness import Harness
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import SCENARIOS, make_scenario
from tulip_sim.timing import TICK
from tulip_sim.world import World


class SimulatedBody(Body):
    """A robot on its field, alone with its joints and sensors: no camera, no referee.

    Args:
        robot: What it is like.
        scenario: What stands where at the start.
        seed: Of the scenario and of all noise.
        harness: Whether it hangs from its trunk, feet off the ground, as a real one does when it is first switched on.
        engine: Of its physics, one of `ENGINES`.

    Raises:
        ValueError: for an unknown scenario or engine, or a seed that is none.
    """

    hardware = False
    simulated = True

    def __init__(
        self,
        robot: Robot,
        scenario: str = "open",
        seed: int = 0,
        harness: bool = False,
        engine: str = WorldParameters.engine,
    ) -> None:
        if scenario not in SCENARIOS:
            raise ValueError(f"scenario is {scenario!r}; expected one of {', '.join(SCENARIOS)}")
        if not isinstance(seed, int) or seed < 0:
            raise ValueError(f"seed is {seed!r}; expected an integer >= 0")
        self._robot, self._scenario, self._seed, self._hangs = robot, scenario, seed, harness
        self._parameters = WorldParameters(engine=engine)
        self._world: World | None = None
        self._harness: Harness | None = None

    def start(self) -> None:
        """Make the world; the robot holds its posture until the first command."""
        self.stop()
        field = load_field()
        scenario = make_scenario(self._scenario, np.random.default_rng(self._seed), field)
        self._world = World(scenario, self._parameters, self._seed, field, self._robot)
        self._harness = Harness(self._world) if self._hangs else None

    def exchange(self, command: JointCommand | None) -> Sensors:
        """Give the command to the joints' driver, and let a tick pass.

        Raises:
            BodyError: if the body was not started, or its driver refuses the command.
        """
        if self._world is None:
            raise BodyError("The simulated body was not started; call start() first.")
        for part in by_parts(command) if command is not None else ():
            reason = self._world.apply(part)
            if reason:
                raise BodyError(f"The simulated joints refuse a command: {reason}.")
        if self._harness is not None:
            self._harness.pull()
        self._world.advance(TICK)
        return self._world.sensors()

    def stop(self) -> None:
        """End the world."""
        if self._world is not None:
            self._world.close()
            self._world = None
