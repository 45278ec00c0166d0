"""The page's right side: where the robot is, its camera, balance, joints, localization, tree and nodes."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from html import escape

import numpy as np
import viser

from tulip_description.planar import wrap_angle
from tulip_description.robot import JOINTS
from tulip_view.live import words
from tulip_view.live.balance_picture import HEIGHT, WIDTH, balance_picture
from tulip_view.live.curves import error_curves, joint_curves
from tulip_view.live.plots import Plot
from tulip_view.live.scene import Scene
from tulip_view.live.shapes import show
from tulip_view.live.sight import newest_picture
from tulip_view.report.figures import BLUE, GREEN, GREY, ORANGE, RED

PLOTS = 0.5  # [s] between two drawings of the diagrams and words, which cost the browser more than the rest
PICTURE = 0.25  # [s] between two pictures
BLANK = np.full((HEIGHT, WIDTH, 3), 235, np.uint8)
JPEG = 75  # quality of the pictures
STYLE = '<div style="padding:0 0.8em;font-size:0.85em;line-height:1.4">{}</div>'


class InfoPanel:
    """Everything that is told and drawn beside the 3D scene."""

    def __init__(self, server: viser.ViserServer, scene: Scene, remarks: Callable[[], Sequence[str]]) -> None:
        """Add it.

        Args:
            server: Of the page.
            scene: What there is to see.
            remarks: Returns what is not shown and why, and what else should be said about the source, in sentences.
        """
        self._scene, self._remarks = scene, remarks
        self._shown: tuple[str, float] | None = None
        self._changes = 0
        self._plots_due = self._picture_due = 0.0
        gui = server.gui
        gui.main_panel.dock_right()
        gui.main_panel.set_width(400)
        self._status = gui.add_html("")
        self.ghost = gui.add_checkbox("truth as a ghost", True)
        tabs = gui.add_tab_group()
        with tabs.add_tab("Now"):
            self._game = gui.add_html("")
            self.sources = gui.add_dropdown("picture", ("",), visible=False)
            self._picture = gui.add_image(BLANK, format="jpeg", jpeg_quality=JPEG, visible=False)
            self._found = gui.add_html("")
            self._balance = gui.add_image(BLANK, label="over the feet, toes up", format="png", visible=False)
            self._notes = gui.add_html("")
        with tabs.add_tab("Joints"):
            self._joint = gui.add_dropdown(
                "joint", tuple(name.replace("_", " ") for name in JOINTS), initial_value="left knee"
            )
            self._angle = Plot(server, "angle [deg]", (("desired", ORANGE), ("measured", BLUE)))
            parts = (("feedback", BLUE), ("feedforward", ORANGE), ("learned", GREEN), ("measured", GREY))
            self._torque = Plot(server, "torque [N m]", parts)
        with tabs.add_tab("Error"):
            self._distance = Plot(server, "place: error, and 2 sigma claimed [m]", (("error", RED), ("2 sigma", GREY)))
            self._turn = Plot(server, "heading: error [deg]", (("error", RED),))
        with tabs.add_tab("Tree"):
            self._tree = gui.add_html("")
        with tabs.add_tab("Nodes"):
            self._health = gui.add_html("")

    def draw(self) -> None:
        """Tell and draw what there is now; pictures and diagrams more rarely than it is called."""
        now = time.monotonic()
        self._say(self._status, self._where())
        if now >= self._picture_due:
            self._picture_due = now + PICTURE
            self._draw_picture()
            self._draw_balance()
        if now >= self._plots_due:
            self._plots_due = now + PLOTS
            self._draw_plots()
            told = self._scene.told
            self._say(self._game, told(words.game))
            self._say(self._tree, told(words.tree))
            self._say(self._health, told(words.health))
            self._say(self._notes, "<br>".join(f"<small>{escape(line)}</small>" for line in self._remarks()))

    def draw_all(self) -> None:
        """Let the next call of `draw` draw everything."""
        self._plots_due = self._picture_due = 0.0

    def _say(self, handle: viser.GuiHtmlHandle, text: str) -> None:
        """Change a text if it is another one."""
        text = STYLE.format(text)
        if handle.content != text:
            handle.content = text

    def _where(self) -> str:
        """Return time, place and error in one line."""
        around, truth = self._scene.around(), self._scene.truth()
        lines = [f"time <b>{self._scene.stamp:.2f} s</b>"]
        pose = around.pose
        if pose is not None:
            lines.append(f"x {pose.x:.2f} m, y {pose.y:.2f} m, yaw {math.degrees(pose.yaw):.0f}°")
        if pose is not None and truth is not None:
            off = math.hypot(pose.x - truth.footprint.x, pose.y - truth.footprint.y)
            turn = math.degrees(wrap_angle(pose.yaw - truth.footprint.yaw))
            lines.append(f"error {100.0 * off:.1f} cm, {turn:+.1f}°")
        return " · ".join(lines)

    def _draw_picture(self) -> None:
        found = self._scene.told(newest_picture)
        key = (found[0].name, found[1]) if found is not None else None
        if key == self._shown:
            return
        self._shown = key
        sight = self._scene.sight()
        show(self._picture, sight is not None)
        if sight is not None:
            self._picture.image = sight.picture[:, :, ::-1]
        self._say(self._found, escape(f"{sight.stamp:.2f} s: {sight.words}") if sight is not None else "no picture")

    def _draw_balance(self) -> None:
        if self._scene.changes == self._changes:
            return
        self._changes = self._scene.changes
        balance = self._scene.balance()
        show(self._balance, balance is not None)
        if balance is not None:
            self._balance.image = balance_picture(balance)

    def _draw_plots(self) -> None:
        joint = JOINTS[self._joint.options.index(self._joint.value)]
        curves = self._scene.told(lambda buffers: joint_curves(buffers, joint))
        self._angle.draw(curves.times, (np.degrees(curves.desired), np.degrees(curves.measured)))
        self._torque.draw(curves.times, (curves.feedback, curves.feedforward, curves.learned, curves.sensed))
        errors = self._scene.told(error_curves)
        self._distance.draw(errors.times, (errors.distance, errors.claimed))
        self._turn.draw(errors.times, (np.degrees(errors.turn),))
