"""Every kind of input from outside: what it looks like, how it is read, and with which errors it may be refused.

A reader takes an input or raises one of its errors. Whatever else it raises is a defect, as is a result that cannot be
(`WrongError`): a component changed by what it refused, a robot of mass NaN.
"""

from __future__ import annotations

import io
import random
import struct
import zipfile
import zlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.serialization import deserialize_message

from tulip_description.body_file import BodyFileError, read_body
from tulip_description.camera_mount import MountFileError, load_mount
from tulip_description.field import FieldError, load_field
from tulip_description.model import floating_model
from tulip_description.robot import load_robot
from tulip_description.robot_file import read_robot
from tulip_motion.gait_file import GaitFileError, read_gait
from tulip_motion.head import HeadParameters
from tulip_motion.learning_file import LearningFileError, load
from tulip_motion.parameters import MotionParameters
from tulip_msgs.msg import UserCommand
from tulip_ros import log_notes, parameters, schemas, topics
from tulip_ros.bag_metadata import NAME as BAG_NOTES
from tulip_ros.cdr import without_gaps
from tulip_ros.errors import BadInputError
from tulip_ros.latched import quality_of
from tulip_ros.log_file import Log, files_of
from tulip_ros.log_summary import rhythms
from tulip_ros.plan import EVERY_NODE, make_plan, read_parameters
from tulip_ros.recovery import recover
from tulip_ros.replay import playable
from tulip_ros.serialized import after_header, time_at
from tulip_sim.recompute.settings import flattened
from tulip_strategy.behaviour.tree import STRATEGIES
from tulip_strategy.game_controller import Rejected, decode_reply
from tulip_strategy.game_input import GameInput, GameInputParameters
from tulip_strategy.strategy_node import StrategyNodeParameters
from tulip_strategy.user_input import UserInput, UserInputParameters
from tulip_view.bridge.handshake import RefusedError, admit, answered
from tulip_view.columns import GROUPS
from tulip_view.fuzz import samples
from tulip_view.fuzz.mutation import damaged, damaged_text
from tulip_view.recording import choose_robot
from tulip_view.recording import read as read_tracks
from tulip_view.report.build import WANTED, make_report
from tulip_view.report.page import make_page
from tulip_view.tables import make_table, regular_times, sources_of
from tulip_vision.calibration.recording import FILE as SHOTS
from tulip_vision.calibration.recording import RecordingError, read_recording
from tulip_vision.coded_picture import decode_picture
from tulip_vision.colour_file import ColourFileError, read_colours
from tulip_vision.lens_file import LensFileError, read_lens
from tulip_vision.pipeline import VisionParameters
from tulip_worldmodel.messages import start_pose_from_message
from tulip_worldmodel.worldmodel_node import WorldModelNodeParameters

Make = Callable[[random.Random], bytes]
Read = Callable[[bytes, Path], str]
"""Reads bytes, with an empty folder for files, and returns "" or why they were refused where that is no error."""
SIZE = (640, 480)  # [px] of the pictures that belong to a lens file that does not say it
ROWS = 50.0  # [Hz] of a table of a recording


class WrongError(Exception):
    """An input was taken or refused as it must not be."""


@dataclass(frozen=True)
class Kind:
    """One kind of input.

    Attributes:
        name: In words.
        make: Returns an input; the same for the same random numbers.
        read: Reads one.
        refusals: Errors with which it may be refused.
        count: How many the bench reads.
        samples: Whole inputs, all of which must be taken or refused without an error.
    """

    name: str
    make: Make
    read: Read
    refusals: tuple[type[Exception], ...]
    count: int = 10_000
    samples: Callable[[], Sequence[bytes]] = tuple


def packet(data: bytes, folder: Path) -> str:
    """Give a datagram to game input, which keeps its state if it refuses it."""
    game = _game()
    before = game.state(_STAMP)
    rejected = game.receive(data, _STAMP)
    if rejected is None:
        state = game.state(_STAMP)
        if state is None or state.stamp != _STAMP:
            raise WrongError(f"a packet was taken, but the state is {state}")
        return ""
    if game.state(_STAMP) != before:
        raise WrongError(f"a packet was refused ({rejected.reason}), but the state changed")
    return rejected.fault.value


def reply(data: bytes, folder: Path) -> str:
    """Read a robot's reply as the referee does."""
    found = decode_reply(data)
    return found.fault.value if isinstance(found, Rejected) else ""


def wish(data: bytes, folder: Path) -> str:
    """Give what a viewer publishes to user input, which keeps its command if it refuses it."""
    message = deserialize_message(data, UserCommand)
    user = _user()
    before = user.command
    forward, left, turning = (float(value) for value in message.velocity)
    refusal = user.ask(_STAMP, message.request, message.strategy, (forward, left, turning), message.argument)
    if refusal:
        if user.command != before:
            raise WrongError(f"a wish was refused ({refusal}), but the command changed")
        return "wish"
    if not np.isfinite(user.command.velocity).all():
        raise WrongError(f"a wish was taken with velocity {user.command.velocity}")
    return ""


def start_pose(data: bytes, folder: Path) -> str:
    """Read a start pose as the world model does."""
    pose = start_pose_from_message(deserialize_message(data, topics.START_POSE.message))
    if pose is not None and not np.isfinite([pose.x, pose.y, pose.yaw]).all():
        raise WrongError(f"a start pose was taken: {pose}")
    return "" if pose is not None else "pose"


def head(data: bytes, folder: Path) -> str:
    """Look at the head of a request for the bridge, and of an answer."""
    admission = admit(data, ("http://192.168.0.7:8080",))
    if not admission.request.endswith(b"\r\n\r\n") or b"\r\n\r\n" in admission.request[:-4]:
        raise WrongError(f"what is passed on is more than one head: {admission.request!r}")
    answered(data, admission.name)
    return ""


def robot_file(data: bytes, folder: Path) -> str:
    """Read robot.yaml."""
    robot = read_robot("playing", _file(folder, "robot.yaml", data))
    masses = [link.mass for link in robot.links]
    if not np.isfinite(masses).all() or min(masses) <= 0.0:
        raise WrongError(f"a robot was taken whose links weigh {masses} kg")
    floating_model(robot)
    return ""


def body_file(data: bytes, folder: Path) -> str:
    """Read a body file and put it on the robot."""
    robot = read_body(_file(folder, "body.yaml", data)).on(load_robot())
    floating_model(robot)
    return ""


def field_file(data: bytes, folder: Path) -> str:
    """Read field.yaml."""
    field = load_field(_file(folder, "field.yaml", data))
    if not np.isfinite([field.carpet_length, field.carpet_width]).all():
        raise WrongError(f"a field was taken that is {field.carpet_length} m long")
    return ""


def mount_file(data: bytes, folder: Path) -> str:
    """Read camera_mount.yaml."""
    if not np.isfinite(load_mount(_file(folder, "mount.yaml", data)).rotation).all():
        raise WrongError("a camera's mount was taken whose angles are not finite")
    return ""


def gait_file(data: bytes, folder: Path) -> str:
    """Read gait.yaml."""
    read_gait(_file(folder, "gait.yaml", data))
    return ""


def colour_file(data: bytes, folder: Path) -> str:
    """Read colours.yaml."""
    read_colours(_file(folder, "colours.yaml", data))
    return ""


def lens_file(data: bytes, folder: Path) -> str:
    """Read a lens file and use the lens."""
    lens = read_lens(_file(folder, "lens.yaml", data), SIZE)
    lens.project(np.array([[0.1, 0.2, 1.0]]))
    return ""


def shots_file(data: bytes, folder: Path) -> str:
    """Read the file of a calibration's pictures."""
    _file(folder, SHOTS, data)
    read_recording(folder)
    return ""


def parameter_file(data: bytes, folder: Path) -> str:
    """Read a parameter file, write the nodes' command lines from it, and give the values to the nodes' dataclasses."""
    path = _file(folder, "parameters.yaml", data)
    given = read_parameters(path)
    for start in make_plan(parameter_files=[path]):
        start.command(folder / "node.yaml")
    for name, defaults in _defaults().items():
        values = {**flattened(given.get(EVERY_NODE, {})), **flattened(given.get(name, {}))}
        own = {key: value for key, value in values.items() if key not in parameters.ROS_NAMES}
        found = parameters.plain(parameters.replace(defaults, own, name))
        wrong = [key for key, value in found.items() if isinstance(value, float | list) and np.isnan(value).any()]
        if wrong:
            raise WrongError(f"parameter {wrong[0]} of {name} was taken as NaN")
    return ""


def learning_file(data: bytes, folder: Path) -> str:
    """Read what was learned."""
    load(_file(folder, "learned.npz", data), samples.OWNER, samples.MEMORY)
    return ""


def picture(data: bytes, folder: Path) -> str:
    """Decode a picture."""
    found = decode_picture(data)
    if found.ndim != 3 or found.shape[2] != 3 or found.size == 0:
        raise WrongError(f"a picture was taken of shape {found.shape}")
    return ""


def recording(data: bytes, folder: Path) -> str:
    """Read all of a recording: notes, attached files, parameters, every message."""
    path = _file(folder, "a.mcap", data)
    with Log(path) as log:
        _read_all(log)
    if path.read_bytes() != data:
        raise WrongError("a recording was changed by being read")
    return ""


def folder_of_recording(data: bytes, folder: Path) -> str:
    """Find the files of a recording by its metadata.yaml."""
    _file(folder, BAG_NOTES, data)
    _file(folder, "a.mcap", b"")
    found = files_of(folder)
    if not found or any(each.parent != folder for each in found):
        raise WrongError(f"files were taken for those of a recording: {found}")
    return ""


def damaged_recording(data: bytes, folder: Path) -> str:
    """Mend a recording; what comes of it must be whole, and the old one as it was."""
    path = _file(folder, "a.mcap", data)
    output = recover(path, folder / "mended").output
    if path.read_bytes() != data:
        raise WrongError("a recording was changed by being mended")
    if output is not None:
        try:
            with Log(output) as log:
                rhythms(log, lambda count: None)
        except BadInputError as error:
            raise WrongError(f"a recording is damaged after it was mended: {error}") from error
    return ""


def table(data: bytes, folder: Path) -> str:
    """Make a table of a recording, as export.py does."""
    with Log(_file(folder, "a.mcap", data)) as log:
        sources = sources_of(list(GROUPS))
        tracks = read_tracks(log, choose_robot(log, None), WANTED)
        make_table(tracks, sources, regular_times(tracks, ROWS))
    return ""


def report(data: bytes, folder: Path) -> str:
    """Make a report of a recording, as report.py does."""
    with Log(_file(folder, "a.mcap", data)) as log:
        make_page(make_report(log, choose_robot(log, None), lambda count: None))
    return ""


def message(data: bytes, folder: Path) -> str:
    """Compare serialized messages and look for times in them, of every type that a recording has."""
    failed = 0
    for name in samples.messages():
        type_name = next(topic.type_name for topic in topics.TOPICS if topic.name == name)
        for act in (
            lambda type_name=type_name: without_gaps(type_name, data),
            lambda: time_at(data),
            lambda: time_at(data, after_header(data)),
        ):
            try:
                act()
            except ValueError:
                failed += 1
        try:
            deserialize_message(data, schemas.message_class(type_name))
        except rclpy_implementation.RMWError:
            failed += 1
    return "partly" if failed else ""


def _read_all(log: Log) -> None:
    playable(log)
    for topic in log.topics.values():
        quality_of(topic)
    log_notes.parameters_of(log)
    rhythms(log, lambda count: None)
    refused: BadInputError | None = None
    for record in log.records():
        try:
            log.decode(record)
        except BadInputError as error:  # the other messages must be readable all the same
            refused = error
    if not isinstance(log.metadata, dict) or log.span[0] < 0:
        raise WrongError(f"a recording was taken with notes {log.metadata} from {log.span}")
    if refused is not None:
        raise refused


def _file(folder: Path, name: str, data: bytes) -> Path:
    path = folder / name
    path.write_bytes(data)
    return path


_STAMP = 10**9  # [ns]


@cache
def _game() -> GameInput:
    return GameInput(GameInputParameters())


@cache
def _user() -> UserInput:
    return UserInput(UserInputParameters(), tuple(STRATEGIES))


@cache
def _defaults() -> dict[str, object]:
    return {
        "vision": VisionParameters(),
        "head": HeadParameters(),
        "motion": MotionParameters(),
        "strategy": StrategyNodeParameters(),
        "worldmodel": WorldModelNodeParameters(),
        "game_input": GameInputParameters(),
        "user_input": UserInputParameters(),
    }


def _bytes_like(found: Callable[[], Sequence[bytes]]) -> Make:
    return lambda rng: damaged(rng, found())


def _text_like(found: Callable[[], Sequence[bytes]]) -> Make:
    return lambda rng: damaged_text(rng, found())


def _recording_like(rng: random.Random) -> bytes:
    """Return a recording that is damaged as a file, or one that is sound but for what it holds."""
    if rng.random() < 0.5:
        return damaged(rng, samples.recordings())
    compression = rng.choice(("zstd", "lz4", ""))
    return samples.recording(lambda data: damaged(rng, [data, *samples.wishes()]), compression, rng=rng)


def _message_like(rng: random.Random) -> bytes:
    return damaged(rng, [each for found in samples.messages().values() for each in found])


def _learning_like(rng: random.Random) -> bytes:
    """Return a learning file that is damaged, or whose arrays are, in an archive that is sound."""
    data = damaged(rng, samples.learning_files()) if rng.random() < 0.3 else rng.choice(samples.learning_files())
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            held = {name: archive.read(name) for name in archive.namelist()}
    except (zipfile.BadZipFile, ValueError, OSError, RuntimeError, EOFError, zlib.error, struct.error):
        return data
    name, written = rng.choice(sorted(held)), io.BytesIO()
    held[name] = damaged(rng, list(held.values()) if rng.random() < 0.1 else [held[name]])
    with zipfile.ZipFile(written, "w", rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))) as archive:
        for each, content in held.items():
            archive.writestr(each, content)
    return written.getvalue()


def _yaml(name: str, read: Read, error: type[Exception], found: Callable[[], Sequence[bytes]]) -> Kind:
    return Kind(name, _text_like(found), read, (error,), samples=found)


RMW = rclpy_implementation.RMWError
KINDS = (
    Kind("referee's packets (UDP)", _bytes_like(samples.packets), packet, (), 1_000_000, samples.packets),
    Kind("robots' replies (UDP)", _bytes_like(samples.replies), reply, (), 1_000_000, samples.replies),
    Kind(
        "requests to the bridge (WebSocket)", _bytes_like(samples.heads), head, (RefusedError,), samples=samples.heads
    ),
    Kind("wishes of viewers", _bytes_like(samples.wishes), wish, (RMW,), samples=samples.wishes),
    Kind("start poses of viewers", _bytes_like(samples.start_poses), start_pose, (RMW,), samples=samples.start_poses),
    Kind("recordings (MCAP)", _recording_like, recording, (BadInputError,), samples=samples.recordings),
    Kind("recordings to mend", _recording_like, damaged_recording, (BadInputError,), samples=samples.recordings),
    Kind("recordings as tables", _recording_like, table, (BadInputError,), samples=samples.recordings),
    Kind("recordings as reports", _recording_like, report, (BadInputError,), 1_000, samples.recordings),
    Kind("messages in them (CDR)", _message_like, message, ()),
    Kind("pictures in them", _bytes_like(samples.pictures), picture, (ValueError,), samples=samples.pictures),
    _yaml("metadata.yaml of recordings", folder_of_recording, BadInputError, samples.bag_notes),
    _yaml("parameter files", parameter_file, BadInputError, samples.parameter_files),
    _yaml("robot.yaml", robot_file, ValueError, samples.robot_file),
    _yaml("body files", body_file, BodyFileError, samples.body_file),
    _yaml("field files", field_file, FieldError, samples.field_file),
    _yaml("camera_mount.yaml", mount_file, MountFileError, samples.mount_file),
    _yaml("gait.yaml", gait_file, GaitFileError, samples.gait_file),
    _yaml("colours.yaml", colour_file, ColourFileError, samples.colour_file),
    _yaml("lens files", lens_file, LensFileError, samples.lens_files),
    _yaml("files of calibration pictures", shots_file, RecordingError, samples.shots_file),
    Kind(
        "learning files (.npz)",
        _learning_like,
        learning_file,
        (LearningFileError,),
        samples=samples.learning_files,
    ),
)
