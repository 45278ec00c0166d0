"""Node "user_input": services for people and tools in, the user's last wish and the emergency stop out."""

from __future__ import annotations

from dataclasses import asdict
from time import monotonic
from typing import Any

from tulip_description.emergency_stop import StopWord
from tulip_ros import topics
from tulip_ros.emergency_stop import StopLink
from tulip_ros.errors import BadInputError
from tulip_ros.run import ComponentNode, run
from tulip_strategy.behaviour.tree import STRATEGIES
from tulip_strategy.interface import UserCommand, UserRequest
from tulip_strategy.messages import user_command_to_message
from tulip_strategy.user_input import UserInput, UserInputParameters

TRIGGERS = {
    topics.START: UserRequest.PLAY,
    topics.STOP: UserRequest.STOP,
    topics.STAND: UserRequest.STAND,
    topics.GO_LIMP: UserRequest.LIMP,
}
"""Services without arguments, for the wishes that need none, and what each asks for."""


LOOK = 0.1  # [s] between two looks at whether who has the robot walk is still there


class UserInputNode(ComponentNode):
    """Takes wishes and publishes the one that holds."""

    def __init__(self) -> None:
        """Make the core, publish the first command, and serve.

        Raises:
            BadInputError: if the strategy to begin with is not known.
        """
        super().__init__("user_input")
        self._settings = self.load(UserInputParameters())
        self._command = self.sender(topics.USER_COMMAND)
        self._sign = monotonic()  # [s] the last one of whoever has the robot walk
        self._emergency_stop = StopLink(self, "user_input", self._on_emergency_stop)
        self.health.check(self._emergency_stop.finding)
        self._make_core()
        self._recall()
        self.follow_clock()
        self.listen(topics.USER_WISH, self._on_published_wish)
        self.listen(topics.USER_PRESENT, self._on_sign)
        self.every(LOOK, self._look_for_the_user)
        self.create_service(topics.SET_USER_COMMAND.type, topics.SET_USER_COMMAND.name, self._on_wish)
        for service, request in TRIGGERS.items():
            self.create_service(service.type, service.name, self._trigger(request))
        for service, answer in ((topics.ENGAGE_STOP, self._on_engage), (topics.RELEASE_STOP, self._on_release)):
            self.create_service(service.type, service.name, answer)

    def begin_anew(self) -> None:
        """Publish the wish that the core starts with."""
        self._make_core()
        self._publish()

    def _make_core(self) -> None:
        try:
            self._input = UserInput(self._settings, tuple(STRATEGIES), self._now())
        except ValueError as error:
            raise BadInputError(f"Parameters of node 'user_input': {error}") from error
        if self._emergency_stop.engaged:  # that time began anew is no release
            self._input.stop(self._now(), str(self._emergency_stop.word))

    def _recall(self) -> None:
        """Publish the wish to begin with: the one that held when this node died, so that no stop is forgotten."""
        kept = self.keepsake.read()
        if kept:
            kept["request"], kept["velocity"] = UserRequest(kept["request"]), tuple(kept["velocity"])
            self._input.recall(UserCommand(**kept))
        self._publish()

    def _on_engage(self, _: Any, response: Any) -> Any:
        self._emergency_stop.engage("asked by service")
        response.success = True
        return response

    def _on_release(self, _: Any, response: Any) -> Any:
        try:
            self._emergency_stop.release()
        except ValueError as error:
            response.message = str(error)
        else:
            response.success = True
        return response

    def _on_emergency_stop(self, word: StopWord) -> None:
        if word.engaged:
            self._input.stop(self._now(), str(word))
            self._publish()
        else:
            self._input.release()

    def _on_wish(self, request: Any, response: Any) -> Any:
        return self._answer(self._ask(request), response)

    def _on_published_wish(self, message: Any) -> None:
        self._settle(self._ask(message))

    def _on_sign(self, _: Any) -> None:
        self._sign = monotonic()

    def _look_for_the_user(self) -> None:
        """End a walk test that nobody is there for any more: a link that broke must not leave the robot walking."""
        silent = monotonic() - self._sign  # wall clock: however slow a simulation is, people are not
        if silent > self._settings.walk_test_lifetime and self._input.end_walk_test(self._now()):
            self.health.count("abandoned walk tests", f"walk test ended: no sign of its user for {silent:.1f} s")
            self._publish()

    def _ask(self, wish: Any) -> str:
        self._sign = monotonic()
        forward, left, turning = (float(value) for value in wish.velocity)
        return self._input.ask(self._now(), wish.request, wish.strategy, (forward, left, turning), wish.argument)

    def _trigger(self, wish: UserRequest) -> Any:
        return lambda _, response: self._answer(self._input.ask(self._now(), wish), response)

    def _answer(self, refusal: str, response: Any) -> Any:
        response.success = not refusal
        response.message = refusal
        self._settle(refusal)
        return response

    def _settle(self, refusal: str) -> None:
        """Publish the wish that holds now, or tell why the new one was refused."""
        if refusal:
            self.health.count("refused wishes", f"refused: {refusal}")
        else:
            self.health.count("wishes")
            self._publish()

    def _publish(self) -> None:
        self._command.publish(user_command_to_message(self._input.command))
        self.keepsake.keep(asdict(self._input.command))

    def _now(self) -> int:
        """Return the time [ns]: a wish carries no stamp of its own."""
        return int(self.get_clock().now().nanoseconds)


def main() -> None:
    """Run the node."""
    run(UserInputNode)


if __name__ == "__main__":
    main()
