"""What was learned, as a file: an .npz that says which robot and which gait it belongs to."""

from __future__ import annotations

import hashlib
import json
import os
import tokenize
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path

import numpy as np

from tulip_description.robot import Robot
from tulip_motion.parameters import MotionParameters
from tulip_motion.step_learning import Key, Situation, StepLearner

VERSION = 1
LARGEST = 2**24  # [B] of its arrays; a situation takes some kilobytes
DAMAGES = (
    *(OSError, ValueError, LookupError, TypeError, EOFError, OverflowError, MemoryError, RuntimeError),
    *(zipfile.BadZipFile, zlib.error, tokenize.TokenError, SystemError),
)
"""What NumPy and the library of .npz files raise on meeting something else."""
APART = (
    *("kick_", "max_kick_", "side_kick_", "max_side_kick_", "walking_kick_", "max_walking_kick_", "ball_radius"),
    *("body_file", "learning_", "odometry_", "limp_", "fall_", "upright_"),
)
"""Beginnings of the parameters that leave a step as it is, and of one that the robot's digest speaks of."""


class LearningFile:
    """Where a learner keeps what it learned between runs: `learning_file`, if any.

    A path without the ending .npz is a folder, in which each robot and gait has a file of its own.
    """

    def __init__(self, parameters: MotionParameters, robot: Robot, learner: StepLearner) -> None:
        """Give the learner what the file holds; one that does not fit is left alone until the next `save`."""
        self._owner = belongs_to(parameters, robot)
        self._path = _path_for(parameters.learning_file, self._owner)
        self._learner = learner
        self.note = ""
        """What went wrong with the file, in words, or ""."""
        if self._path is None:
            return
        try:
            learner.situations = load(self._path, self._owner, learner.shape)
        except FileNotFoundError:
            pass  # the first run of this robot
        except LearningFileError as error:
            self.note = f"learning file {self._path} refused: {error}; learning begins from zero"

    def save(self) -> None:
        """Write what is new. What did harm is not kept."""
        learner = self._learner
        if self._path is None or not learner.changed or learner.note:
            return
        learner.changed = False
        try:
            save(self._path, self._owner, learner.situations)
        except OSError as error:
            self.note = f"learning file {self._path} cannot be written: {error}"


def _path_for(name: str, owner: Mapping[str, object]) -> Path | None:
    """Return the file of an owner, or None if nothing is kept."""
    if not name:
        return None
    if name.endswith(".npz"):
        return Path(name)
    digest = hashlib.sha256(json.dumps(owner, sort_keys=True).encode()).hexdigest()
    return Path(name) / f"{digest[:16]}.npz"


class LearningFileError(Exception):
    """A file cannot be used; the message says why."""


def belongs_to(parameters: MotionParameters, robot: Robot) -> dict[str, object]:
    """Return what a memory belongs to: the robot's digest and every parameter that shapes a step, by name."""
    gait = {
        field.name: getattr(parameters, field.name) for field in fields(parameters) if not field.name.startswith(APART)
    }
    digest = hashlib.sha256(repr(robot).encode()).hexdigest()
    found: dict[str, object] = json.loads(json.dumps({"robot": digest, **gait}))
    return found


def save(path: Path, owner: Mapping[str, object], situations: Mapping[Key, Situation]) -> None:
    """Write the memories; a file that was there stays whole until the new one is.

    Args:
        path: Of the file; its folder is made.
        owner: From `belongs_to`.
        situations: By key.

    Raises:
        OSError: if it cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    keys = sorted(situations)
    found = [situations[key] for key in keys]
    temporary = path.with_name(path.name + ".part")
    with temporary.open("wb") as file:
        np.savez(
            file,
            version=np.array(VERSION),
            owner=np.array(json.dumps(owner)),
            keys=np.array(keys, dtype=np.int64).reshape(-1, 3),
            memories=np.array([situation.memory for situation in found]),
            baselines=np.array([situation.baselines for situation in found]),
        )
    os.replace(temporary, path)


def load(path: Path, owner: Mapping[str, object], shape: tuple[int, ...]) -> dict[Key, Situation]:
    """Return the memories of a file.

    Args:
        path: Of the file.
        owner: From `belongs_to`, for this robot and these parameters.
        shape: Of the memory of one situation.

    Raises:
        FileNotFoundError: if there is no file.
        LearningFileError: if it is damaged, of another version, or belongs to another robot or other parameters.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(each.file_size for each in archive.infolist())
            if size > LARGEST:
                raise LearningFileError(f"it holds {size} bytes; expected at most {LARGEST}")
        with np.load(path, allow_pickle=False) as file:
            version = int(file["version"])
            if version != VERSION:
                raise LearningFileError(f"it is of version {version}; expected {VERSION}")
            theirs = json.loads(str(file["owner"]))
            # A member that is no array comes as bytes.
            keys, memories, baselines = (np.asarray(file[name]) for name in ("keys", "memories", "baselines"))
    except FileNotFoundError:
        raise
    except DAMAGES as error:
        raise LearningFileError(f"it is damaged or no .npz file ({type(error).__name__})") from error
    _check_owner(theirs, owner)
    count = keys.shape[0] if keys.ndim else 0
    if count == 0:
        return {}
    expected = {"keys": ((count, 3), "i"), "memories": ((count, *shape), "f"), "baselines": ((count, 2), "f")}
    for (name, (wanted, kind)), array in zip(expected.items(), (keys, memories, baselines), strict=True):
        if array.shape != wanted or array.dtype.kind != kind:
            raise LearningFileError(f"its {name} are {array.shape} of {array.dtype}; expected {wanted} numbers")
        if not np.isfinite(array).all() or (name == "baselines" and (array < 0.0).any()):
            raise LearningFileError(f"its {name} are not all finite and in range")
    return {
        (int(key[0]), int(key[1]), int(key[2])): Situation(memory.copy(), baseline.copy())
        for key, memory, baseline in zip(keys, memories, baselines, strict=True)
    }


def _check_owner(theirs: object, ours: Mapping[str, object]) -> None:
    """Raise LearningFileError if a file belongs to another robot, or to other parameters, and name the first."""
    if not isinstance(theirs, dict):
        raise LearningFileError("it does not say what it belongs to")
    if theirs.get("robot") != ours["robot"]:
        raise LearningFileError("it belongs to another robot")
    for name in sorted(set(theirs) | set(ours)):
        if theirs.get(name) != ours.get(name):
            raise LearningFileError(f"it belongs to {name} {theirs.get(name)}; expected {ours.get(name)}")
