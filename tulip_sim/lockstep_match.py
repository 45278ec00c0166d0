"""A whole match in lockstep: two robots with all their components, one world, one referee, and people round the field.

Deterministic: the same settings and seed give the same match, bit for bit, on one machine.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_sim.hands import Hands
from tulip_sim.match_places import in_map_of, team_truth
from tulip_sim.match_referee import MatchReferee
from tulip_sim.match_report import MatchReport
from tulip_sim.match_rules import TEAMS, Role
from tulip_sim.match_settings import MatchSettings
from tulip_sim.robot_stack import RobotStack
from tulip_sim.scenario import Scenario
from tulip_sim.timing import CAMERA_TICKS, TICK
from tulip_sim.world import World
from tulip_strategy.interface import UserRequest

MatchListener = Callable[[int, str, int, object], None]
"""Is told everything that passes between a robot's components: robot, topic name, stamp [ns], object."""


class MatchRobot(RobotStack):
    """One of the two robots; what it is told and tells is in its own team's map."""

    referee: MatchReferee

    def _tell_truth(self, stamp: int) -> None:
        truth = team_truth(self.world, self._number)
        self._tell("ground_truth", stamp, (truth, self.referee.verdict(self._number)))


class LockstepMatch:
    """Two robots, their world and a referee, advanced together tick by tick."""

    def __init__(
        self,
        seed: int,
        settings: MatchSettings | None = None,
        listener: MatchListener | None = None,
        eyes_beside: bool = False,
    ) -> None:
        """Wire everything.

        Args:
            seed: Of everything random.
            settings: Parameters of everything.
            listener: Told of every message that the graph would carry.
            eyes_beside: Let each robot's camera and vision work in a process of their own: faster where cores are
                free. Call `close` at the end then. The match is the same.
        """
        self.settings = settings or MatchSettings()
        field = load_field()
        fields = (field, field.turned())
        self.referee = MatchReferee(self.settings.rules, field, seed)
        (first, second), ball = self.referee.places
        scenario = Scenario(first, ball, poles=bool(field.poles), others=(second,))
        self.world = World(scenario, self.settings.world, seed, field, load_robot())
        robots = []
        for team in TEAMS:
            robot = MatchRobot(
                self.world,
                self.settings.of_team(team),
                in_map_of(team, (first, second)[team]),
                2 * seed + team,  # noise of the pictures
                None if listener is None else partial(listener, team),
                eyes_beside,
                team,
                fields[team],
                team * CAMERA_TICKS // 2,  # in turns: two processes of eyes share a core evenly
            )
            robot.referee = self.referee
            robots.append(robot)
        self.robots = tuple(robots)
        self._hands = Hands(self.world, self)

    @property
    def stamp(self) -> int:
        """Time since the start [ns]."""
        return self.world.stamp

    def step(self) -> None:
        """Advance by one control tick."""
        for robot in self.robots:
            robot.tick()
        self.world.advance(TICK)
        self._hands.move()
        truths = [self.world.truth(team) for team in TEAMS]
        packet = self.referee.update(truths)
        for order in self.referee.take_orders():
            self._hands.take(order)
        if packet is not None:
            for robot in self.robots:
                robot.hear_referee(packet, truths[0].stamp)

    def play(self, progress: Callable[[LockstepMatch], None] | None = None) -> MatchReport:
        """Play until the match is decided.

        Args:
            progress: Called once in a simulated second.
        """
        every = round(1000 / TICK)
        ticks = 0
        while not self.referee.report.finished:
            self.step()
            ticks += 1
            if progress is not None and ticks % every == 0:
                progress(self)
        return self.referee.report

    def close(self) -> None:
        """Free the physics engine and end the processes of the eyes, if there are any; the match cannot go on then."""
        for robot in self.robots:
            robot.close()
        self.world.close()
        del self._hands  # which know this match: else its 45 MB would wait until Python looks for such garbage

    def make_limp(self, robot: int) -> None:
        """Switch a robot's legs off."""
        self.robots[robot].ask(UserRequest.LIMP)

    def let_stand(self, robot: int) -> None:
        """Have a robot stand up straight."""
        self.robots[robot].ask(UserRequest.STAND)

    def let_play(self, robot: int, role: Role) -> None:
        """Let a robot play, and tell it as what."""
        self.robots[robot].ask(UserRequest.PLAY, self.settings.strategy(role))

    def tell_place(self, robot: int, pose: Pose2D) -> None:
        """Tell a robot where it stands, in its own map."""
        self.robots[robot].told_to_stand_at(pose)
