"""What people ask for by a button or a key: calls of the services of user input, recorder, simulator and experiment."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from threading import RLock
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import String

from tulip_description.emergency_stop import StopWord
from tulip_ros import topics
from tulip_ros.asking import Asker, NotServedError, ServiceClient
from tulip_ros.emergency_stop import StopLink
from tulip_ros.topics import Service
from tulip_strategy.interface import UserRequest
from tulip_strategy.user_input import Wish
from tulip_view.outcome import PUSHES, Outcome

PRESENCE = 0.25  # [s] between two signs that the user is there; the walk test ends after six that are missing
NO_USER_INPUT = "node user_input does not run: python3 scripts/launch.py starts it"
NO_SIMULATOR = "no simulator of a single robot runs"
NO_RECORDER = "no recorder runs; start one in a terminal: python3 scripts/record.py --wait"
NO_EXPERIMENT = "node identify does not run: python3 scripts/launch.py identify starts it"


class UserCalls:
    """Clients of all that people can ask a robot for. Calls do not wait for answers, which are told when they come."""

    def __init__(
        self,
        node: Node,
        asker: Asker,
        face: str,
        robot: str,
        tell: Callable[[Outcome], None],
        is_watched: Callable[[], bool] = lambda: True,
    ) -> None:
        """Make the clients.

        Args:
            node: Has them; an executor serves it.
            asker: That node's.
            face: What people have before them, as in "menu".
            robot: Namespace of the robot; "" for one that is alone.
            tell: Is told each outcome, from the node's thread or the caller's.
            is_watched: Whether somebody is at this face; a walk test that began here ends soon after nobody is.
        """
        self._asker, self._tell = asker, tell
        self._order = RLock()  # of wishes: answers come in another thread
        self._walk_is_asked = False
        self._next_walk: Wish | None = None
        self._walk: list[float] | None = None  # velocity of the walk test that this face began and that holds
        self._is_watched = is_watched
        self._sign = String(data=node.get_fully_qualified_name())
        self._present = topics.USER_PRESENT.within(robot).publish_from(node)
        topics.USER_COMMAND.within(robot).subscribe_from(node, self._on_command)
        node.create_timer(PRESENCE, self._give_sign, clock=Clock(clock_type=ClockType.STEADY_TIME))

        def full(name: str, namespace: str = robot) -> str:
            return f"/{namespace}/{name}".replace("//", "/")

        def client(service: Service, namespace: str = robot) -> ServiceClient:
            return asker.client(service.type, full(service.name, namespace))

        stop = topics.EMERGENCY_STOP
        self._stop = StopLink(node, face, topic=replace(stop, name=full(stop.name)), knows_time=False)
        self._wishes, self._pushes, self._releases = map(
            client, (topics.SET_USER_COMMAND, topics.PUSH, topics.RELEASE_STOP)
        )
        # A recorder of the robot's own, or one outside that records all robots.
        self._recorders = {
            begin: [client(service, namespace) for namespace in dict.fromkeys((robot, ""))]
            for begin, service in ((True, topics.START_RECORDING), (False, topics.STOP_RECORDING))
        }
        self._experiments = {True: client(topics.BEGIN_IDENTIFICATION), False: client(topics.ABORT_IDENTIFICATION)}

    @property
    def reaches_user_input(self) -> bool:
        """Whether node user_input is there."""
        return bool(self._wishes.service_is_ready() and self._releases.service_is_ready())

    @property
    def reaches_experiment(self) -> bool:
        """Whether node identify is there."""
        return bool(self._experiments[False].service_is_ready())

    @property
    def stop(self) -> StopWord:
        """What counts of the emergency stop."""
        return self._stop.word

    def emergency_stop(self, reason: str) -> None:
        """Stop the robot; every node hears it by itself, so that none is needed for the others.

        Args:
            reason: In words, as in "key l".
        """
        with self._order:
            self._next_walk = self._walk = None
            self._stop.engage(reason)
        self._tell(Outcome("emergency stop", "sent"))

    def release(self) -> None:
        """Release the emergency stop; the robot stays limp until the next wish."""
        self._ask(self._releases, self._releases.srv_type.Request(), "release", NO_USER_INPUT)

    def wish(self, wish: Wish) -> None:
        """Tell the robot what the user wants.

        While the answer to a walk test is due, of further ones only the newest waits, and any other wish goes before it
        and in its place: a key that is held down must not fill the queue of a robot that is slow to answer.
        """
        with self._order:
            self._next_walk = None
            self._walk = list(wish.velocity) if wish.request is UserRequest.WALK_TEST else None
            if self._walk_is_asked and wish.request is UserRequest.WALK_TEST:
                self._next_walk = wish
            else:
                self._send(wish)

    def _send(self, wish: Wish) -> None:
        request = topics.SET_USER_COMMAND.type.Request(
            request=wish.request.value, strategy=wish.strategy, velocity=list(wish.velocity), argument=wish.argument
        )
        walks = wish.request is UserRequest.WALK_TEST
        self._walk_is_asked |= walks
        what = wish.request.name.lower().replace("_", " ")
        self._ask(self._wishes, request, what, NO_USER_INPUT, self._walk_is_answered if walks else None)

    def _walk_is_answered(self, served: bool) -> None:
        """Send the speeds that wait, unless nobody has answered: by then nobody expects them any more."""
        with self._order:
            self._walk_is_asked, wish, self._next_walk = False, self._next_walk, None
            if served and wish is not None:
                self._send(wish)

    def _on_command(self, command: Any) -> None:
        """Leave the walk test to others if another wish holds; what is heard before the answer is from before."""
        with self._order:
            if not self._walk_is_asked and (
                command.request != UserRequest.WALK_TEST or list(command.velocity) != self._walk
            ):
                self._walk = None

    def _give_sign(self) -> None:
        if self._walk is not None and self._is_watched():
            self._present.publish(self._sign)

    def push(self, direction: str, size: float, heading: float) -> None:
        """Push the simulated robot's trunk.

        Args:
            direction: One of `PUSHES`.
            size: Impulse [N s].
            heading: Where the robot looks in the map [rad].
        """
        angle = heading + math.radians(PUSHES[direction])
        request = topics.PUSH.type.Request(impulse=[size * math.cos(angle), size * math.sin(angle), 0.0])
        self._ask(self._pushes, request, f"push {direction}", NO_SIMULATOR)

    def record(self, begin: bool) -> None:
        """Begin or end a recording."""
        clients = self._recorders[begin]
        ready = next((client for client in clients if client.service_is_ready()), clients[0])
        what = "recording" if begin else "end of the recording"
        self._ask(ready, ready.srv_type.Request(), what, NO_RECORDER)

    def identify(self, begin: bool) -> None:
        """Begin the identification experiment, or end it early."""
        client = self._experiments[begin]
        what = "identification" if begin else "end of the identification"
        self._ask(client, client.srv_type.Request(), what, NO_EXPERIMENT)

    def _ask(
        self, client: ServiceClient, request: Any, what: str, missing: str, then: Callable[[bool], None] | None = None
    ) -> None:
        def answered(answer: Future[Any]) -> None:
            said = None
            try:
                said = answer.result()
            except NotServedError as error:
                self._tell(Outcome(what, "not done", str(error) if found else missing))
            else:
                self._tell(Outcome(what, "taken" if said.success else "refused", said.message))
            if then is not None:
                then(said is not None)

        found = client.service_is_ready()
        self._asker.ask(client, request).add_done_callback(answered)
