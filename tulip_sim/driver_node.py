"""The simulator behind the driver's contract: joint commands in; sensors, pictures, clock and truth out."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NoReturn

import numpy as np

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_msgs.srv import PlaceBall, Push, Reset
from tulip_ros import topics
from tulip_ros.run import run
from tulip_sim.crew import Crew
from tulip_sim.hands import Hands
from tulip_sim.judging import SECOND, Verdict
from tulip_sim.match_referee import Order, SetDown
from tulip_sim.match_rules import Role
from tulip_sim.referee import Referee, RefereeParameters
from tulip_sim.referee_link import hear_replies, open_referee
from tulip_sim.scenario import SCENARIOS, make_scenario
from tulip_sim.secret_body import hidden_truth
from tulip_sim.simulator_node import Joints, SimulatorNode, SimulatorParameters, Spin, TopicJoints
from tulip_sim.truth import Truth
from tulip_sim.world import World
from tulip_strategy.interface import UserRequest

LYING = 3 * SECOND  # [ns] until people help: time enough to see what the robot does by itself
PUSH_TIME = 100  # [ms] over which a push's impulse is spread


@dataclass(frozen=True)
class DriverNodeParameters(SimulatorParameters):
    """How the simulator runs, and what it simulates."""

    scenario: str = "trial"
    hands: bool = False  # people set a robot that lies on its feet again, where it is, and let it play on
    secret_body: int = -1  # seed of other masses and CoMs that the robot really has, untold; -1 for robot.yaml's
    rules: RefereeParameters = field(default_factory=RefereeParameters)

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not usable.
        """
        super().__post_init__()
        if self.scenario not in SCENARIOS:
            raise ValueError(f"scenario is {self.scenario!r}; expected one of {', '.join(SCENARIOS)}")
        if self.secret_body < -1:
            raise ValueError(f"secret_body is {self.secret_body}; expected a seed >= 0, or -1 for none")


class DriverNode(SimulatorNode):
    """Owns the world of one robot."""

    def __init__(
        self,
        name: str = "driver",
        defaults: DriverNodeParameters | None = None,
        joints: Callable[[SimulatorNode, int, str], Joints] = TopicJoints,
        tells_time: bool = True,
    ) -> None:
        """Make the world and connect it.

        Args:
            name: Of the node.
            defaults: Its parameters.
            joints: As for `SimulatorNode.prepare`.
            tells_time: As for `SimulatorNode.prepare`.
        """
        super().__init__(name)
        p = self._settings = self.load(defaults or DriverNodeParameters())
        self._field, self._robot = load_field(), load_robot()
        self._referee = Referee(p.rules, self._field)
        self._referee_socket = (
            open_referee(p.referee_address, p.referee_port, p.rules.version, p.reply_port) if p.referee else None
        )
        self.prepare(p, [("", p.pictures)], joints, tells_time)
        for service, answer in (
            (topics.RESET, self._on_reset),
            (topics.PLACE_BALL, self._on_place_ball),
            (topics.PUSH, self._on_push),
        ):
            self.create_service(service.type, service.name, answer)
        self._crew = Crew(self, "")
        self._wish: tuple[str, int] | None = None  # scenario and seed to begin anew with
        self._begin(p.scenario, p.seed)
        if self.keepsake.read():  # the robot has played in another world, until this node died
            self._tell_start()
        self.keepsake.keep({"began": True})

    def _begin(self, scenario: str, seed: int) -> None:
        self._scenario_name = scenario
        start = make_scenario(scenario, np.random.default_rng(seed), self._field)
        secret = self._settings.secret_body
        body, world = hidden_truth(self._robot, self._settings.world, None if secret < 0 else secret)
        self._referee.restart()
        self.begin_world(World(start, world, seed, self._field, self._robot, true_body=body), [[seed, 1]])
        self._hands = Hands(self.world, self)
        self._fell: int | None = None  # stamp [ns] since when the robot lies

    def _tell_start(self) -> None:
        """Tell the robot where it stands in its new world; in the first one its parameters say so."""
        self._crew.tell_place(self.world.scenario.robot)

    @property
    def interrupted(self) -> bool:
        """Whether another world was wished for."""
        return self._wish is not None

    def advance(self, spin: Spin) -> None:
        """Let one control tick pass, of a new world if one was wished for."""
        if self._wish is not None:
            wish, self._wish = self._wish, None
            self.world.close()
            self._begin(*wish)
            self._tell_start()
        super().advance(spin)

    def judge(self, spin: Spin) -> list[tuple[Truth, Verdict]]:
        """Let the referee see what is, and send its packet."""
        self._hands.move()
        truth = self.world.truth()
        packet = self._referee.update(truth)
        if self._settings.hands:
            self._help(truth)
        self._crew.speak(spin, self._settings.answer_bound)
        if packet is not None and self._referee_socket is not None:
            self._referee_socket.send(packet)
            hear_replies(self._referee_socket, self.health)
        return [(truth, self._referee.verdict())]

    def _help(self, truth: Truth) -> None:
        """Have the robot set on its feet if it lies for long."""
        if not self._referee.lying:
            self._fell = None
        elif self._fell is None:
            self._fell = truth.stamp
        elif truth.stamp - self._fell > LYING:
            (x, y, _), (_, _, turn, rest) = truth.base_position.tolist(), truth.base_orientation.tolist()
            self._hands.take(Order((SetDown(0, Pose2D(x, y, 2.0 * math.atan2(turn, rest)), Role.STRIKER),)))
            self._fell = truth.stamp

    def make_limp(self, robot: int) -> None:
        """Switch the robot's legs off."""
        self._want(UserRequest.LIMP)

    def let_stand(self, robot: int) -> None:
        """Have the robot stand up straight."""
        self._want(UserRequest.STAND)

    def let_play(self, robot: int, role: Role) -> None:
        """Let the robot play on as before."""
        self._want(UserRequest.PLAY)

    def tell_place(self, robot: int, pose: Pose2D) -> None:
        """Tell the robot where it stands."""
        self._crew.tell_place(pose)

    def _want(self, request: UserRequest) -> None:
        self._crew.want(request)

    def _on_reset(self, request: Reset.Request, response: Reset.Response) -> Reset.Response:
        name = request.scenario or self._scenario_name
        if name not in SCENARIOS:
            response.message = f"scenario is {name!r}; expected one of {', '.join(SCENARIOS)}"
        elif request.seed < 0:
            response.message = f"seed is {request.seed}; expected >= 0"
        else:
            self._wish = (name, request.seed)  # for the next tick: the present one is under way
            response.success = True
        return response

    def _on_place_ball(self, request: PlaceBall.Request, response: PlaceBall.Response) -> PlaceBall.Response:
        try:
            self.world.place_ball(*request.position.tolist(), *request.velocity.tolist())
            response.success = True
        except ValueError as error:
            response.message = str(error)
        return response

    def _on_push(self, request: Push.Request, response: Push.Response) -> Push.Response:
        try:
            self.world.push(request.impulse / (PUSH_TIME * 1e-3), PUSH_TIME)
            response.success = True
        except ValueError as error:
            response.message = str(error)
        return response


def main() -> NoReturn:
    """Run the simulator until SIGINT or SIGTERM."""
    run(DriverNode, DriverNode.advance)


if __name__ == "__main__":
    main()
