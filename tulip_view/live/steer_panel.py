"""The page's left side while a robot runs: emergency stop, start, stop, stand, tests, pushes, recordings."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from html import escape
from threading import Lock

import viser

from tulip_strategy.behaviour.tree import STRATEGIES
from tulip_strategy.interface import UserRequest
from tulip_strategy.user_input import SIDES, UserInputParameters, Wish
from tulip_view.live.info_panel import STYLE
from tulip_view.outcome import PUSHES, Outcome
from tulip_view.user_calls import UserCalls

WIDTH = 270  # [px]
STOP, RELEASE = "EMERGENCY STOP", "Release"
AS_IT_IS = "as it is"
KEPT = 2  # outcomes in sight: the answer to an older wish may come after the emergency stop and must not hide it


class SteerPanel:
    """Buttons that call the services of user input, recorder and simulator."""

    def __init__(self, server: viser.ViserServer, calls: Callable[[], UserCalls], heading: Callable[[], float]) -> None:
        """Add it.

        Args:
            server: Of the page.
            calls: Returns what calls the services of the robot that is shown.
            heading: Returns where the robot looks in the map [rad].
        """
        self._calls = calls
        self._outcomes: deque[Outcome] = deque(maxlen=KEPT)
        self._telling = Lock()  # answers come in the node's thread, the emergency stop's outcome in the page's
        gui = server.gui
        always = gui.add_panel()
        with always.add_tab("Steer"):
            emergency = gui.add_button(STOP, color="red", hint="No stiffness in any joint, until released. Key: L")
            release = gui.add_button(RELEASE, hint="End the emergency stop; the robot stays limp until the next wish")
            self._on(gui.add_button("Stop", hint="Stop and stand, whatever the referee says"), Wish(UserRequest.STOP))
            self._on(gui.add_button("Stand", hint="Stand up straight"), Wish(UserRequest.STAND))
            self._on(gui.add_button("Limp", hint="Legs without stiffness until the next wish"), Wish(UserRequest.LIMP))
            strategy = gui.add_dropdown("strategy", (AS_IT_IS, *STRATEGIES))
            start = gui.add_button("Start", color="green", hint="Obey the referee and play")
            self._answer = gui.add_html("")
        always.dock_left()
        always.set_width(WIDTH)
        emergency.on_click(lambda _: calls().emergency_stop("button"))
        gui.add_command("Emergency stop", hotkey="L").on_trigger(lambda _: calls().emergency_stop("key l"))
        release.on_click(lambda _: calls().release())
        tests = gui.add_panel()  # of its own: however long it is, the buttons above stay in sight
        with tests.add_tab("Test"):
            with gui.add_folder("Walk test", expand_by_default=False):
                sliders = [
                    gui.add_slider(name, -limit, limit, 0.05, 0.0)
                    for name, limit in zip(
                        ("forward [m/s]", "left [m/s]", "turn [rad/s]"),
                        UserInputParameters.walk_test_limits,
                        strict=True,
                    )
                ]
                walk = gui.add_button("Walk")
            with gui.add_folder("Kick test", expand_by_default=False):
                for side in SIDES:
                    self._on(gui.add_button(f"Kick {side}"), Wish(UserRequest.KICK_TEST, argument=side))
            with gui.add_folder("Simulator", expand_by_default=False):
                direction = gui.add_dropdown("push", tuple(PUSHES))
                strength = gui.add_slider("impulse [N s]", 1.0, 15.0, 0.5, 4.0)
                push = gui.add_button("Push the trunk")
            with gui.add_folder("Recording", expand_by_default=False):
                begin, end = gui.add_button("Begin a recording"), gui.add_button("End the recording")
        tests.dock_below(always)

        @start.on_click
        def _(event: object) -> None:
            name = "" if strategy.value == AS_IT_IS else strategy.value
            calls().wish(Wish(UserRequest.PLAY, strategy=name))

        @walk.on_click
        def _(event: object) -> None:
            forward, left, turning = (float(slider.value) for slider in sliders)
            calls().wish(Wish(UserRequest.WALK_TEST, velocity=(forward, left, turning)))

        @push.on_click
        def _(event: object) -> None:
            calls().push(direction.value, strength.value, heading())

        begin.on_click(lambda _: calls().record(True))
        end.on_click(lambda _: calls().record(False))

    def tell(self, outcome: Outcome) -> None:
        """Show what came of a wish, and below it what was shown before."""
        with self._telling:
            self._outcomes.appendleft(outcome)
            lines = "<br>".join(escape(str(each)) for each in self._outcomes)
            self._answer.content = STYLE.format(f"<b>{lines}</b>")

    def _on(self, button: viser.GuiButtonHandle, wish: Wish) -> None:
        button.on_click(lambda _: self._calls().wish(wish))
