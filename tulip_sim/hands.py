"""People round the field: they switch a robot's legs off, set it on its feet elsewhere, and let it play on."""

from __future__ import annotations

from typing import Protocol

from tulip_description.planar import Pose2D
from tulip_sim.match_places import in_map_of
from tulip_sim.match_referee import Order, SetDown
from tulip_sim.match_rules import Role
from tulip_sim.world import World

MILLISECOND = 1_000_000  # [ns]
LIMP_TIME = 100 * MILLISECOND  # [ns] from the wish for limp legs until they are, through a graph too
STANDING_TIME = 700 * MILLISECOND  # [ns] until a robot that was set down stands, and has forgotten that it was lifted


class Team(Protocol):
    """A team at its robot's menu."""

    def make_limp(self, robot: int) -> None:
        """Switch the legs off."""

    def let_stand(self, robot: int) -> None:
        """Have it stand up straight, as soon as it is held upright."""

    def let_play(self, robot: int, role: Role) -> None:
        """Let it play, and tell it as what."""

    def tell_place(self, robot: int, pose: Pose2D) -> None:
        """Tell the robot where it stands, in its own map."""


class Hands:
    """Carry out the referee's orders, step by step as people would."""

    def __init__(self, world: World, team: Team) -> None:
        self._world, self._team = world, team
        self._carried: list[_Carried] = []
        self._ball: tuple[int, tuple[float, float]] | None = None

    def take(self, order: Order) -> None:
        """Begin to carry out an order. An older one about the same robot is forgotten."""
        now = self._world.stamp
        names = {each.robot for each in order.robots}
        self._carried = [each for each in self._carried if each.order.robot not in names]
        for each in order.robots:
            self._team.make_limp(each.robot)
            self._carried.append(_Carried(each, now))
        if order.ball is not None:
            self._ball = (now + LIMP_TIME, order.ball)

    def move(self) -> None:
        """Do what is due now; at every control tick."""
        now = self._world.stamp
        for each in self._carried:
            each.move(now, self._world, self._team)
        self._carried = [each for each in self._carried if not each.done]
        if self._ball is not None and now >= self._ball[0]:
            self._world.place_ball(*self._ball[1])
            self._ball = None


class _Carried:
    """A robot in somebody's hands."""

    def __init__(self, order: SetDown, now: int) -> None:
        self.order, self._from = order, now
        self._stands = self.done = False

    def move(self, now: int, world: World, team: Team) -> None:
        robot, pose = self.order.robot, self.order.pose
        since = now - self._from
        if not self._stands and since >= LIMP_TIME:
            world.set_upright(pose, robot)
            team.let_stand(robot)
            self._stands = True
        elif since >= LIMP_TIME + STANDING_TIME:
            team.tell_place(robot, in_map_of(robot, pose))
            team.let_play(robot, self.order.role)
            self.done = True
