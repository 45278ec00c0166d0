"""A whole trial in one process: one robot's cores, the same as in the graph, with its world and a referee.

Deterministic: the same scenario, settings and seed give the same trial, bit for bit, on one machine. What
takes time in the graph takes as long here.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_sim.parameters import WorldParameters
from tulip_sim.referee import Outcome, Referee, RefereeParameters
from tulip_sim.robot_stack import Listener, RobotSettings, RobotStack
from tulip_sim.scenario import Scenario
from tulip_sim.timing import TICK
from tulip_sim.world import World


@dataclass(frozen=True)
class Settings(RobotSettings):
    """Parameters of the robot's cores, of the world and of the referee."""

    world: WorldParameters = field(default_factory=WorldParameters)
    referee: RefereeParameters = field(default_factory=RefereeParameters)


class Lockstep(RobotStack):
    """One robot, its world and a referee, advanced together tick by tick."""

    def __init__(
        self,
        scenario: Scenario,
        seed: int,
        settings: Settings | None = None,
        listener: Listener | None = None,
        eyes_beside: bool = False,
        belief: Pose2D | None = None,
    ) -> None:
        """Wire the cores.

        Args:
            scenario: What stands where at the start. The robot knows its own start pose, as its team would
                tell it, and nothing else.
            seed: Of everything random.
            settings: Parameters of all cores.
            listener: Told of every message that the graph would carry.
            eyes_beside: Let camera and vision work in a process of their own: faster where a core is free.
                Call `close` at the end then. The trial is the same.
            belief: Where the robot is told to stand, if that is not where it stands.
        """
        settings = settings or Settings()
        robot_field = load_field()
        world = World(scenario, settings.world, seed, robot_field, load_robot())
        self.referee = Referee(settings.referee, robot_field)
        super().__init__(world, settings, belief or scenario.robot, seed, listener, eyes_beside)

    @property
    def stamp(self) -> int:
        """Time since the start [ns]."""
        return self.world.stamp

    def step(self) -> None:
        """Advance by one control tick."""
        self.tick()
        self.world.advance(TICK)
        truth = self.world.truth()
        packet = self.referee.update(truth)
        if packet is not None:
            self.hear_referee(packet, truth.stamp)

    def play(self, progress: Callable[[Lockstep], None] | None = None, limit: float = 200.0) -> Outcome | None:
        """Play until the referee ends the trial.

        Args:
            progress: Called once in a simulated second.
            limit: Longest time [s]; None is returned if the referee has not ended the trial by then.
        """
        every = round(1000 / TICK)
        while self.referee.outcome is None and self.stamp < limit * 1e9:
            self.step()
            if progress is not None and self._tick % every == 0:
                progress(self)
        self._tell_truth(self.stamp)  # with the outcome
        return self.referee.outcome

    def close(self) -> None:
        """Free the physics engine and end the process of the eyes, if there is one."""
        super().close()
        self.world.close()

    def _tell_truth(self, stamp: int) -> None:
        self._tell("ground_truth", stamp, (self.world.truth(), self.referee.verdict()))
