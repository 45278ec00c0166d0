"""The 3D part of the page: the field, the robot at its estimated pose, the truth as a ghost, and what is around."""

from __future__ import annotations

import math

import numpy as np
import viser
from numpy.typing import NDArray

from tulip_description.field import Field
from tulip_description.keeper import keeper_parts
from tulip_description.planar import Pose2D
from tulip_view.body_pose import COLOURS, OTHER_TEAM
from tulip_view.ellipse import TURN
from tulip_view.live.balance_picture import COLOURS as POINTS
from tulip_view.live.scene import Balance, Scene
from tulip_view.live.shapes import Array, Batch, Solid, at, colour, segments, show
from tulip_view.report.field_paths import ground_lines
from tulip_view.report.figures import BLUE, ORANGE, PURPLE, RED, SKY

MIDDLE = (0.0, 0.0, 0.0)
GHOST = (150, 150, 150)
GHOST_OPACITY = 0.35
POLES = {"yellow": (230, 199, 0), "blue": (30, 80, 190)}
OTHERS = 3  # true figures beside the robot that can be drawn
ABOVE = 0.012  # [m] lines lie so high above the ground that the carpet does not hide them
RING = 0.18  # [m] radius of the ring where an opponent is believed to be
PIN = 0.16  # [m] height of the pins of CoM, ZMP and DCM: above the feet, that would hide points on the ground
ARROW = np.array([(0.0, 0.0), (0.45, 0.0), (0.33, 0.08), (0.45, 0.0), (0.33, -0.08)])


class Stage:
    """Draws a scene."""

    def __init__(self, server: viser.ViserServer, scene: Scene, field: Field) -> None:
        """Draw the field, and prepare what moves.

        Args:
            server: Of the page.
            scene: What there is to see.
            field: The field.
        """
        self._server, self._scene = server, scene
        server.scene.configure_environment_map(None)  # for browsers without a graphics card, as all without shadows
        server.scene.configure_default_lights(True, cast_shadow=False)
        server.scene.add_light_ambient("/light", intensity=1.2)
        _add_field(server, field)
        boxes = [Solid(index, box.size, box.centre, colour(COLOURS[box.colour])) for index, box in scene.body.boxes]
        self._robot = Batch(server, "/robot", boxes)
        self._ghost = Batch(server, "/truth/robot", [box._replace(rgb=GHOST) for box in boxes], GHOST_OPACITY)
        figure = [Solid(0, part.size, part.centre, colour(COLOURS[part.colour])) for part in keeper_parts(OTHER_TEAM)]
        self._others = [Batch(server, f"/truth/figure{number}", figure, 0.6) for number in range(OTHERS)]
        size = 3 * (2.0 * field.ball_radius,)
        self._ball_height = field.ball_radius
        self._ball = Batch(server, "/ball", [Solid(0, size, MIDDLE, colour(RED))], round_=True)
        self._true_ball = Batch(server, "/truth/ball", [Solid(0, size, MIDDLE, colour(ORANGE))], 0.5, round_=True)
        heads = [Solid(index, 3 * (0.03,), MIDDLE, rgb) for index, rgb in enumerate(POINTS.values())]
        self._heads = Batch(server, "/pins", heads, round_=True)
        self._lines = {
            name: _Lines(server, f"/lines/{name}".replace(" ", "_"), rgb, width)
            for name, rgb, width in (
                ("place", colour(BLUE), 0.02),
                ("robot_spread", colour(BLUE), 0.015),
                ("ball_spread", colour(RED), 0.015),
                ("opponents", colour(SKY), 0.03),
                ("soles", (250, 250, 250), 0.006),
                ("footsteps", colour(PURPLE), 0.012),
                *((name, rgb, 0.008) for name, rgb in POINTS.items()),
            )
        }

    def draw(self, ghost: bool = True) -> None:
        """Draw what there is to see now.

        Args:
            ghost: Whether the truth is drawn.
        """
        with self._server.atomic():
            body, truth = self._scene.estimate(), self._scene.truth() if ghost else None
            self._robot.place(body.links if body is not None else None)
            self._ghost.place(truth.links if truth is not None else None)
            self._around(ghost)
            self._balance(self._scene.balance())

    def _around(self, ghost: bool) -> None:
        around = self._scene.around()
        lines = self._lines
        lines["place"].draw([_moved(ARROW, around.pose)] if around.pose is not None else [], closed=False)
        lines["robot_spread"].draw([around.robot_spread] if around.robot_spread is not None else [])
        lines["ball_spread"].draw([around.ball_spread] if around.ball_spread is not None else [])
        ring = RING * np.column_stack([np.cos(TURN), np.sin(TURN)])
        lines["opponents"].draw([place + ring for place in around.opponents])
        ball, true_ball = around.ball, around.true_ball if ghost else None
        self._ball.place(at(np.append(ball, self._ball_height)) if ball is not None else None)
        self._true_ball.place(at(true_ball) if true_ball is not None else None)
        for number, boxes in enumerate(self._others):
            there = ghost and number < len(around.true_others)
            boxes.place(_upright(around.true_others[number]) if there else None)

    def _balance(self, balance: Balance | None) -> None:
        lift = np.array((0.0, 0.0, ABOVE))
        self._lines["footsteps"].draw([corners + lift for corners in self._scene.footsteps()])
        self._lines["soles"].draw([] if balance is None else list(balance.soles + lift))
        points = {name: np.full(3, np.nan) for name in POINTS}
        if balance is not None:
            ground = {
                "CoM": balance.com[:2],
                "DCM": balance.dcm,
                "ZMP": balance.zmp,
                "ZMP wanted": balance.zmp_desired,
            }
            points = {name: np.append(ground[name], PIN) for name in POINTS}
        self._heads.place(at(*points.values()))
        for name, head in points.items():
            foot = head * (1.0, 1.0, 0.0)
            self._lines[name].draw([np.array([foot, head])], closed=False)


class _Lines:
    """Lines that move; what did not move is not sent again."""

    def __init__(self, server: viser.ViserServer, name: str, rgb: tuple[int, int, int], width: float) -> None:
        nothing = np.zeros((1, 2, 3), dtype=np.float32)
        self._handle = server.scene.add_line_segments(name, nothing, rgb, thickness=width, visible=False)

    def draw(self, lines: list[Array], closed: bool = True) -> None:
        pieces = segments(lines, closed)
        show(self._handle, len(pieces) > 0)
        if lines and lines[0].shape[1] == 2:
            pieces[:, :, 2] = ABOVE
        if len(pieces) and not np.array_equal(pieces, self._handle.points):
            self._handle.points = pieces


def _moved(points: Array, pose: Pose2D) -> Array:
    moved: Array = points @ pose.rotation().T + (pose.x, pose.y)
    return moved


def _upright(pose: Pose2D) -> NDArray[np.float32]:
    half = pose.yaw / 2.0
    return np.array([(pose.x, pose.y, 0.0, 0.0, 0.0, math.sin(half), math.cos(half))], dtype=np.float32)


def _add_field(server: viser.ViserServer, field: Field) -> None:
    carpet, lines, _ = ground_lines(field)
    x, y = field.carpet_length / 2.0, field.carpet_width / 2.0
    server.scene.add_mesh_simple(
        "/field/carpet",
        np.array([(-x, -y, 0.0), (x, -y, 0.0), (x, y, 0.0), (-x, y, 0.0)], dtype=np.float32),
        np.array([(0, 1, 2), (0, 2, 3)], dtype=np.uint32),
        color=colour(carpet.colour),
        flat_shading=True,
        side="double",
        cast_shadow=False,
        receive_shadow=False,
    )
    white = segments([np.column_stack([lines.x, lines.y])], closed=False)
    white[:, :, 2] = 0.6 * ABOVE
    server.scene.add_line_segments("/field/lines", white, (255, 255, 255), thickness=0.05)
    frames = []
    for goal in (field.own_goal, field.opponent_goal):
        left, right = (post.y for post in goal.posts)
        z = goal.height
        frames.append(np.array([(goal.x, left, 0.0), (goal.x, left, z), (goal.x, right, z), (goal.x, right, 0.0)]))
        for side in (left, right):
            frames.append(np.array([(goal.x, side, z), (goal.back, side, 0.0), (goal.x, side, 0.0)]))
    server.scene.add_line_segments("/field/goals", segments(frames, closed=False), (230, 199, 0), thickness=0.1)
    for pole in field.poles:
        for number, name in enumerate(pole.colours):
            low, high = number * pole.segment_height, (number + 1) * pole.segment_height
            piece = np.array([[(pole.x, pole.y, low), (pole.x, pole.y, high)]])
            place = f"/field/pole{pole.y:+.1f}/{number}"
            server.scene.add_line_segments(place, piece, POLES[name], thickness=2.0 * pole.radius)
