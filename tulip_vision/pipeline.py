"""From a picture to features: the stages of vision, and what each needs and gives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from tulip_vision.annotation import annotate
from tulip_vision.ball import BallParameters, find_ball
from tulip_vision.border import BorderParameters, find_border
from tulip_vision.crossings import CrossingParameters, find_crossings, find_penalty_marks
from tulip_vision.features import Feature, Features
from tulip_vision.findings import Findings, Refusal
from tulip_vision.goal_frames import find_goals
from tulip_vision.goals import GoalParameters, find_goal_posts
from tulip_vision.lens import Lens
from tulip_vision.line_points import LinePointParameters, find_line_points
from tulip_vision.lines import LineParameters, Lines, find_lines, line_features
from tulip_vision.opponents import OpponentParameters, find_opponents
from tulip_vision.own_body import OwnBody
from tulip_vision.poles import PoleParameters, find_poles
from tulip_vision.segmentation import Picture, Segmentation, SegmentationParameters, Segmenter
from tulip_vision.view import SpreadParameters, View


@dataclass(frozen=True)
class VisionParameters:
    """Parameters of every stage."""

    spread: SpreadParameters = field(default_factory=SpreadParameters)
    segmentation: SegmentationParameters = field(default_factory=SegmentationParameters)
    ball: BallParameters = field(default_factory=BallParameters)
    goals: GoalParameters = field(default_factory=GoalParameters)
    poles: PoleParameters = field(default_factory=PoleParameters)
    opponents: OpponentParameters = field(default_factory=OpponentParameters)
    line_points: LinePointParameters = field(default_factory=LinePointParameters)
    lines: LineParameters = field(default_factory=LineParameters)
    crossings: CrossingParameters = field(default_factory=CrossingParameters)
    border: BorderParameters = field(default_factory=BorderParameters)

    def __post_init__(self) -> None:
        """Check that each part has its own type.

        Raises:
            ValueError: if one has not.
        """
        for part in fields(self):
            if not is_dataclass(getattr(self, part.name)):
                raise ValueError(f"{part.name} is {getattr(self, part.name)!r}; expected {part.type}")


@dataclass(frozen=True)
class Stage:
    """One step of the pipeline.

    Attributes:
        name: Of the step.
        requires: Names of the values that `run` takes, in this order.
        provides: Name of the value that it returns.
        run: The step itself.
    """

    name: str
    requires: tuple[str, ...]
    provides: str
    run: Callable[..., Any]


@dataclass(frozen=True)
class Sight:
    """Everything that is known of one picture after all stages, for the debug picture and for tests.

    Attributes:
        features: The result.
        view: Geometry of the picture.
        segmentation: Colour classes and the carpet's outline.
        lines: Pieces of line and the centre circle.
        refusals: Candidates that were refused.
    """

    features: Features
    view: View
    segmentation: Segmentation
    lines: Lines
    refusals: tuple[Refusal, ...]


INPUTS = ("picture", "view")
"""Values that are there before the first stage."""

SMALLEST = 16
"""[px] width and height of a picture: the search for the carpet looks at two columns of it then."""

DETECTORS = ("ball", "goals", "poles", "opponents", "crossings", "penalty_marks", "border")
"""Values of type `Findings`; their features are the result, together with the lines."""


def stages(parameters: VisionParameters, own_body: OwnBody | None = None) -> tuple[Stage, ...]:
    """Return the stages in the order in which they run.

    Args:
        parameters: Of all stages.
        own_body: The robot's, if its camera may see it.
    """
    p = parameters
    segmenter = Segmenter(p.segmentation)
    seen = ("segmentation", "view")
    return (
        Stage("find own body", ("view",), "own_body", lambda v: None if own_body is None else own_body.mask(v)),
        Stage("segment", ("picture", "view", "own_body"), "segmentation", segmenter.segment),
        Stage("find ball", seen, "ball", lambda s, v: find_ball(s, v, p.ball)),
        Stage("find goal posts", seen, "goal_posts", lambda s, v: find_goal_posts(s, v, p.goals)),
        Stage("pair goal posts", ("goal_posts", *seen), "goals", lambda q, s, v: find_goals(q, s, v, p.goals)),
        Stage("find poles", seen, "poles", lambda s, v: find_poles(s, v, p.poles)),
        Stage(
            "find opponents",
            ("goal_posts", "poles", *seen),
            "opponents",
            lambda g, q, s, v: find_opponents((*g.features, *q.features), s, v, p.opponents),
        ),
        Stage("find line points", seen, "line_points", lambda s, v: find_line_points(s, v, p.line_points)),
        Stage("join lines", ("line_points", "view"), "lines", lambda q, v: find_lines(q, v, p.lines)),
        Stage(
            "find crossings",
            ("lines", "opponents", "goal_posts", *seen),
            "crossings",
            lambda lines, o, g, s, v: find_crossings(lines, o, g, s, v, p.crossings),
        ),
        Stage(
            "find penalty marks",
            ("lines", *seen),
            "penalty_marks",
            lambda lines, s, v: find_penalty_marks(lines, s, v, p.crossings),
        ),
        Stage("find border", seen, "border", lambda s, v: find_border(s, v, p.border)),
    )


def check_stages(order: Sequence[Stage]) -> None:
    """Check that each stage finds what it requires.

    Raises:
        ValueError: if a value is required before it is provided, or provided twice.
    """
    known = set(INPUTS)
    for stage in order:
        missing = [name for name in stage.requires if name not in known]
        if missing:
            raise ValueError(f"stage '{stage.name}' requires {', '.join(missing)}; no stage before it provides that")
        if stage.provides in known:
            raise ValueError(f"stage '{stage.name}' provides {stage.provides}; it is provided already")
        known.add(stage.provides)


class Vision:
    """Finds ball, goal posts, poles, opponents, lines and crossings in pictures of one camera."""

    def __init__(self, parameters: VisionParameters, lens: Lens, own_body: OwnBody | None = None) -> None:
        """Make the pipeline.

        Args:
            parameters: Of all stages.
            lens: Of the camera.
            own_body: The robot's, if its camera may see it.

        Raises:
            ValueError: if the lens makes pictures too small to show anything.
        """
        if min(lens.width, lens.height) < SMALLEST:
            raise ValueError(f"pictures are {lens.width} x {lens.height} px; expected at least {SMALLEST} x {SMALLEST}")
        self._parameters = parameters
        self._lens = lens
        self._stages = stages(parameters, own_body)
        check_stages(self._stages)
        self._last: Sight | None = None

    @property
    def lens(self) -> Lens:
        """Of the camera whose pictures are processed."""
        return self._lens

    @property
    def last(self) -> Sight | None:
        """All that is known of the picture processed last; None before the first."""
        return self._last

    def process(self, picture: Picture, stamp: int, camera_in_footprint: ArrayLike) -> Features:
        """Find the features of one picture. The result depends on these arguments only, not on earlier pictures.

        Args:
            picture: (height, width, 3) BGR, of the lens's size.
            stamp: When it was taken [ns].
            camera_in_footprint: (4, 4) transform of camera_optical_frame in base_footprint at that time.

        Raises:
            ValueError: if the picture or the transform has a wrong shape, type or content.
        """
        _check_picture(picture, self._lens)
        view = View(self._lens, camera_in_footprint, self._parameters.spread)
        board: dict[str, Any] = {"picture": np.ascontiguousarray(picture), "view": view}
        for stage in self._stages:
            board[stage.provides] = stage.run(*(board[name] for name in stage.requires))
        features = Features(stamp, view.position, view.coverage(), _collect(board, view))
        refusals = tuple(refusal for name in DETECTORS for refusal in _findings(board, name).refusals)
        self._last = Sight(features, view, board["segmentation"], board["lines"], refusals)
        return features

    def rehearse(self) -> None:
        """Process a made-up picture: that loads the compiled loops, and compiles them after an installation.

        It takes half a second, or some seconds; the first real picture then takes no longer than others.
        """
        width, height = self._lens.width, self._lens.height
        picture = np.full((height, width, 3), (60, 120, 60), dtype=np.uint8)
        for start, end in (((0.1, 0.5), (0.9, 0.6)), ((0.5, 0.3), (0.4, 1.0)), ((0.0, 0.9), (1.0, 0.8))):
            ends = [(round(u * width), round(v * height)) for u, v in (start, end)]
            cv2.line(picture, ends[0], ends[1], (230, 230, 230), max(width // 80, 2), cv2.LINE_AA)
        cv2.circle(picture, (width // 4, 3 * height // 4), width // 20, (20, 100, 230), -1, cv2.LINE_AA)
        left, right, top = round(0.7 * width), round(0.76 * width), round(0.3 * height)
        cv2.rectangle(
            picture, (left, top), (right, round(0.6 * height)), (60, 60, 60), -1
        )  # an opponent of either team
        cv2.rectangle(picture, (left, top), ((left + right) // 2, round(0.36 * height)), (200, 200, 40), -1)
        cv2.rectangle(picture, ((left + right) // 2, top), (right, round(0.36 * height)), (150, 40, 200), -1)
        down, ahead = math.sin(0.5), math.cos(0.5)
        pose = np.array(
            [[0.0, -down, ahead, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -ahead, -down, 1.1], [0.0, 0.0, 0.0, 1.0]]
        )
        self.process(picture, 0, pose)
        self._last = None

    def annotate(self, picture: Picture, features: Features) -> NDArray[np.uint8]:
        """Return a copy of the picture processed last with everything found, and refused, drawn into it.

        Args:
            picture: (height, width, 3) BGR, the one processed last.
            features: What `process` returned for it.

        Raises:
            ValueError: if `features` are not those of the picture processed last.
        """
        if self._last is None or features is not self._last.features:
            raise ValueError("features are of another picture; expected those that process() returned last")
        _check_picture(picture, self._lens)
        sight = self._last
        return annotate(picture, features, sight.view, sight.segmentation.outline, sight.lines, sight.refusals)


def _collect(board: Mapping[str, Any], view: View) -> tuple[Feature, ...]:
    found = [feature for name in DETECTORS for feature in _findings(board, name).features]
    return (*found, *line_features(board["lines"], view))


def _findings(board: Mapping[str, Any], name: str) -> Findings:
    findings = board[name]
    assert isinstance(findings, Findings)  # DETECTORS names no other values
    return findings


def _check_picture(picture: Picture, lens: Lens) -> None:
    expected = (lens.height, lens.width, 3)
    if not isinstance(picture, np.ndarray) or picture.shape != expected or picture.dtype != np.uint8:
        got = f"{picture.shape} {picture.dtype}" if isinstance(picture, np.ndarray) else type(picture).__name__
        raise ValueError(f"picture is {got}; expected {expected} uint8, BGR, the size of the lens's camera info")
