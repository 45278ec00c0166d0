"""The simulator of a match: one world, two robots in their namespaces, a referee, and people round the field.

The people speak to the robots as people do: through the services of each robot's node user_input, and by telling its
world model where it was set down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NoReturn

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_ros import topics
from tulip_ros.run import run
from tulip_sim.crew import Crew
from tulip_sim.hands import Hands
from tulip_sim.judging import Verdict
from tulip_sim.match_places import team_truth
from tulip_sim.match_referee import MatchReferee
from tulip_sim.match_rules import COLOUR_NAMES, NAMESPACES, STRATEGY_OF, TEAMS, MatchRules, Role
from tulip_sim.messages import report_to_message
from tulip_sim.referee_link import hear_replies, open_referee
from tulip_sim.scenario import Scenario
from tulip_sim.simulator_node import SimulatorNode, SimulatorParameters, Spin
from tulip_sim.truth import Truth
from tulip_sim.world import World
from tulip_strategy.game_controller import REFEREE_PORT
from tulip_strategy.interface import UserRequest


@dataclass(frozen=True)
class MatchDriverNodeParameters(SimulatorParameters):
    """How the simulator runs, and the rules of the match."""

    second_referee_port: int = REFEREE_PORT + 2  # UDP, of the second robot's game input on the same machine
    striker: str = STRATEGY_OF[Role.STRIKER]  # strategy that a striker is told to play
    keeper: str = STRATEGY_OF[Role.KEEPER]  # strategy that a goalkeeper is told to play
    rules: MatchRules = field(default_factory=MatchRules)


class MatchDriverNode(SimulatorNode):
    """Owns the world of two robots."""

    def __init__(self) -> None:
        """Make the world and connect it."""
        super().__init__("driver")
        p = self._settings = self.load(MatchDriverNodeParameters())
        self._report = self.sender(topics.REPORT)
        self._referee_socket = None
        if p.referee:
            ports = p.referee_port, (p.second_referee_port,)
            self._referee_socket = open_referee(p.referee_address, ports[0], p.rules.version, p.reply_port, ports[1])
        cameras = [
            replace(p.pictures, team_colour=COLOUR_NAMES[team], keeper_colour=COLOUR_NAMES[1 - team]) for team in TEAMS
        ]
        self.prepare(p, list(zip(NAMESPACES, cameras, strict=True)))
        self._crews = [Crew(self, namespace) for namespace in NAMESPACES]
        playing_field = load_field()
        self._referee = MatchReferee(p.rules, playing_field, p.seed)
        (first, second), ball = self._referee.places
        scenario = Scenario(first, ball, poles=bool(playing_field.poles), others=(second,))
        self.begin_world(World(scenario, p.world, p.seed, playing_field, load_robot()), [[p.seed, 1], [p.seed, 2]])
        self._hands = Hands(self.world, self)
        self._said = 0

    def judge(self, spin: Spin) -> Sequence[tuple[Truth, Verdict]]:
        """Let people and referee do their part."""
        self._hands.move()
        packet = self._referee.update([self.world.truth(team) for team in TEAMS])
        for order in self._referee.take_orders():
            self._hands.take(order)
        for crew in self._crews:
            crew.speak(spin, self._settings.answer_bound)
        if packet is not None and self._referee_socket is not None:
            self._referee_socket.send(packet)
            hear_replies(self._referee_socket, self.health)
        if len(self._referee.report.log) != self._said:
            self._said = len(self._referee.report.log)
            self._report.publish(report_to_message(self._referee.report))
        return [(team_truth(self.world, team), self._referee.verdict(team)) for team in TEAMS]

    def make_limp(self, robot: int) -> None:
        """Switch a robot's legs off."""
        self._crews[robot].want(UserRequest.LIMP)

    def let_stand(self, robot: int) -> None:
        """Have a robot stand up straight."""
        self._crews[robot].want(UserRequest.STAND)

    def let_play(self, robot: int, role: Role) -> None:
        """Let a robot play, and tell it as what."""
        p = self._settings
        self._crews[robot].want(UserRequest.PLAY, p.striker if role is Role.STRIKER else p.keeper)

    def tell_place(self, robot: int, pose: Pose2D) -> None:
        """Tell a robot where it stands, in its own map."""
        self._crews[robot].tell_place(pose)


def main() -> NoReturn:
    """Run the simulator until SIGINT or SIGTERM."""
    run(MatchDriverNode, MatchDriverNode.advance)


if __name__ == "__main__":
    main()
