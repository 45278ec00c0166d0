"""The head camera and vision of a lockstep, in the same process or beside it in one of its own, or neither.

Rendering and seeing take as long as all the rest together. What a picture shows is needed only 48 ms of
simulated time after its exposure, so a second process can work on it meanwhile. The order of results is
fixed, and so the trial is the same bit for bit. For fast tests of behaviour, `TruthEyes` give features without
pictures.
"""

from __future__ import annotations

import multiprocessing
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_sim.interrupts import left_to_this_process
from tulip_sim.perception import Glimpse, Perception, PerceptionParameters
from tulip_sim.timing import FEATURE_DELAY_TICKS, TICK
from tulip_sim.truth import Truth
from tulip_vision.features import Features
from tulip_vision.lens import head_camera_lens
from tulip_vision.own_body import OwnBody
from tulip_vision.pipeline import Vision, VisionParameters

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class EyesParameters:
    """What camera and vision are made from.

    Attributes:
        camera: Of the renderer.
        vision: Of vision.
        seed: Of the pictures' noise.
    """

    camera: CameraParameters
    vision: VisionParameters
    seed: int


LATENCY = FEATURE_DELAY_TICKS * TICK * 1_000_000  # [ns] of camera and vision


class Eyes(Protocol):
    """Takes pictures and says what they show. One picture is worked on at a time: expose, look, collect."""

    @property
    def latency(self) -> int:
        """Time from the exposure until the features may be used [ns]."""

    def expose(self, truth: Truth) -> None:
        """Take a picture of what is."""

    def look(self, stamp: int, camera_in_footprint: Array) -> None:
        """Begin to find features in the picture taken last, given its stamp [ns] and the (4, 4) camera pose."""

    def collect(self) -> tuple[Picture | None, Features]:
        """Return the picture, if there is one, and its features."""

    def close(self) -> None:
        """Free what is held."""


class OwnEyes:
    """Camera and vision in this process."""

    latency = LATENCY

    def __init__(self, parameters: EyesParameters) -> None:
        """Make camera and vision."""
        lens = head_camera_lens()
        robot = load_robot()
        self._camera = CameraRenderer(parameters.camera, load_field(), robot, lens)
        self._vision = Vision(parameters.vision, lens, OwnBody(robot))
        self._rng = np.random.default_rng([parameters.seed, 1])

    def rehearse(self) -> None:
        """Load vision's compiled loops before the first picture."""
        self._vision.rehearse()

    def expose(self, truth: Truth) -> None:
        """Take a picture of what is."""
        self._picture = self._camera.render(truth, self._rng)

    def look(self, stamp: int, camera_in_footprint: Array) -> None:
        """Find features in the picture."""
        self._features = self._vision.process(self._picture, stamp, camera_in_footprint)

    def collect(self) -> tuple[Picture, Features]:
        """Return the picture and its features."""
        return self._picture, self._features

    def close(self) -> None:
        """Nothing is held."""


class TruthEyes:
    """Neither camera nor vision: features from the truth, as good as parameters say. For fast tests of behaviour."""

    def __init__(self, parameters: EyesParameters, perception: PerceptionParameters) -> None:
        """Make the perception; the camera's parameters count for how it is mounted."""
        self._perception = Perception(
            perception,
            load_field(),
            load_robot(),
            head_camera_lens(),
            parameters.camera,
            parameters.vision.spread,
        )
        self.latency = round(perception.latency * 1e9)
        self._rng = np.random.default_rng([parameters.seed, 1])
        self._glimpses: tuple[Glimpse, ...] = ()

    def expose(self, truth: Truth) -> None:
        """Note what the camera sees."""
        self._glimpses = self._perception.expose(truth, self._rng)

    def look(self, stamp: int, camera_in_footprint: Array) -> None:
        """Make features of it."""
        self._features = self._perception.features(self._glimpses, stamp, camera_in_footprint, self._rng)

    def collect(self) -> tuple[Picture | None, Features]:
        """Return the features; there is no picture."""
        return None, self._features

    def close(self) -> None:
        """Nothing is held."""


class EyesBeside:
    """Camera and vision in a process of their own."""

    latency = LATENCY

    def __init__(self, parameters: EyesParameters) -> None:
        """Start the process and wait until it is ready.

        Raises:
            EOFError: if it cannot start; its own error stands on standard error.
        """
        context = multiprocessing.get_context("spawn")  # a forked child would inherit locks of running threads
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(theirs, parameters), daemon=True)
        with left_to_this_process():
            self._process.start()
        theirs.close()
        self._pipe.recv()  # ready: the process needs some seconds for its imports

    def expose(self, truth: Truth) -> None:
        """Take a picture of what is."""
        self._pipe.send(truth)

    def look(self, stamp: int, camera_in_footprint: Array) -> None:
        """Begin to find features in the picture."""
        self._pipe.send((stamp, camera_in_footprint))

    def collect(self) -> tuple[Picture, Features]:
        """Wait for the picture and its features.

        Raises:
            EOFError: if the process has ended; its own error stands on standard error.
        """
        picture, features = self._pipe.recv()
        return picture, features

    def close(self) -> None:
        """End the process."""
        self._pipe.close()
        self._process.join()


def _serve(pipe: Connection, parameters: EyesParameters) -> None:
    cv2.setNumThreads(1)
    eyes = OwnEyes(parameters)
    eyes.rehearse()
    try:
        pipe.send("ready")
        while True:
            request = pipe.recv()
            if isinstance(request, Truth):
                eyes.expose(request)
            else:
                eyes.look(*request)
                pipe.send(eyes.collect())
    except (EOFError, BrokenPipeError):
        pass  # the lockstep has ended
