"""Parameters of everything in a match between two robots."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from tulip_sim.match_rules import COLOUR_NAMES, COLOURS, STRATEGY_OF, MatchRules, Role
from tulip_sim.parameters import WorldParameters
from tulip_sim.robot_stack import RobotSettings


@dataclass(frozen=True)
class MatchSettings:
    """Parameters of world, rules and both robots.

    Attributes:
        world: Of the physics.
        rules: Of the match.
        robots: Of both robots, without what follows from the team: colours and numbers.
        striker: Name of the strategy that a striker is told to play.
        keeper: Name of the strategy that a goalkeeper is told to play.
    """

    world: WorldParameters = field(default_factory=WorldParameters)
    rules: MatchRules = field(default_factory=MatchRules)
    robots: tuple[RobotSettings, RobotSettings] = field(default_factory=lambda: (RobotSettings(), RobotSettings()))
    striker: str = STRATEGY_OF[Role.STRIKER]
    keeper: str = STRATEGY_OF[Role.KEEPER]

    def strategy(self, role: Role) -> str:
        """Return what a robot is told to play."""
        return self.striker if role is Role.STRIKER else self.keeper

    def of_team(self, team: int) -> RobotSettings:
        """Return the parameters of a team's robot: with its colour, the other's, and its number."""
        settings, own, other = self.robots[team], COLOUR_NAMES[team], COLOUR_NAMES[1 - team]
        return replace(
            settings,
            camera=replace(settings.camera, team_colour=own, keeper_colour=other),
            vision=replace(settings.vision, opponents=replace(settings.vision.opponents, team_colour=own)),
            game_input=replace(
                settings.game_input,
                team_number=self.rules.team_numbers[team],
                player_number=self.rules.player_number,
                team_colour=COLOURS[team],
            ),
        )
