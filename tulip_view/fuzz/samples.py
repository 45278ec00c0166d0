"""Whole inputs of every kind, to be damaged."""

from __future__ import annotations

import json
import random
import tempfile
from array import array
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import cv2
import lz4.frame
import numpy as np
from geometry_msgs.msg import PoseWithCovarianceStamped
from isal.isal_zlib import crc32
from mcap.records import Attachment, Channel, Schema
from nav_msgs.msg import Odometry
from rclpy.serialization import serialize_message
from sensor_msgs.msg import CompressedImage, JointState
from std_msgs.msg import String

import tulip_description
import tulip_motion
import tulip_vision
from tulip_description.body_file import Body, BodySource, links_of, write_body
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.learning_file import save
from tulip_motion.step_learning import Situation
from tulip_msgs.msg import GameState, MotionState, UserCommand
from tulip_ros import bag_metadata, schemas, topics
from tulip_ros.bag_metadata import FileEntry, TopicEntry, quality_profiles
from tulip_ros.log_notes import PARAMETERS
from tulip_ros.mcap_file import Chunk, McapFile
from tulip_sim.bench.referee import good_packets
from tulip_strategy.game_controller import Reply, RobotStatus, encode_reply
from tulip_strategy.game_controller.replies import STATUS_VERSION
from tulip_vision.lens import head_camera_lens
from tulip_vision.lens_file import write_lens

Damage = Callable[[bytes], bytes]
OWNER: Mapping[str, object] = {"robot": "a", "gait": "dcm", "step_time": 0.4}
MEMORY = (12, 5)
"""Whose learning file the sample is, and the shape of what one situation remembers."""
SCRATCH = "/dev/shm" if Path("/dev/shm").is_dir() else None
"""Where small files are written and read by the thousand: in memory, where nothing waits for a disk."""
PICTURE = (24, 32)  # [px] height and width
ELSEWHERE = "pkg/msg/Odd"
"""A type that is not installed: only the recording knows what it is."""
ODD = (
    "std_msgs/Header header\nfloat64[] values\nstring<=20 name\nInner[] rows\nuint8[3] three\n"
    + schemas.SEPARATOR
    + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + schemas.SEPARATOR
    + "MSG: pkg/Inner\nint16 a\nfloat32[2] b\nstring c\n"
)
REPORT = json.dumps({"log": [{"time": 1.0, "text": "goal", "score": [1, 0]}]})


def intact(data: bytes) -> bytes:
    """Return bytes as they are."""
    return data


@cache
def packets() -> tuple[bytes, ...]:
    """Return the referee's packets in each version, phase and penalty."""
    return tuple(good_packets())


@cache
def replies() -> tuple[bytes, ...]:
    """Return replies of robots in each version."""
    status = RobotStatus(False, Pose2D(1.0, 0.5, 0.1), (0.3, 0.0), 0.2)
    return tuple(
        encode_reply(Reply(25, 1, version=version, status=status if version == STATUS_VERSION else None))
        for version in (1, 2, STATUS_VERSION)
    )


def of_package(package: Any, name: str) -> tuple[bytes, ...]:
    """Return a file that lies beside a package's modules."""
    return (Path(str(package.__file__)).with_name(name).read_bytes(),)


def robot_file() -> tuple[bytes, ...]:
    """Return robot.yaml."""
    return of_package(tulip_description, "robot.yaml")


def field_file() -> tuple[bytes, ...]:
    """Return field.yaml."""
    return of_package(tulip_description, "field.yaml")


def mount_file() -> tuple[bytes, ...]:
    """Return camera_mount.yaml."""
    return of_package(tulip_description, "camera_mount.yaml")


def gait_file() -> tuple[bytes, ...]:
    """Return gait.yaml."""
    return of_package(tulip_motion, "gait.yaml")


def colour_file() -> tuple[bytes, ...]:
    """Return colours.yaml."""
    return of_package(tulip_vision, "colours.yaml")


@cache
def body_file() -> tuple[bytes, ...]:
    """Return a body file of the playing robot."""
    robot = load_robot()
    source = BodySource("walk", "2013-06-24", 40)
    body = Body("playing", source, links_of(robot.links), ("a", "b"), np.array([0.1, 1.0]), np.eye(2) * 1e-6, 0.001)
    return (_written("body.yaml", lambda path: write_body(path, body)),)


@cache
def lens_files() -> tuple[bytes, ...]:
    """Return a lens in each of the three forms."""
    lens = head_camera_lens()
    own = _written("lens.yaml", lambda path: write_lens(path, lens))
    info = {key: np.asarray(value).tolist() for key, value in lens.to_camera_info().items()}
    mesh = "projection: EQUISOLID\nfocal_length: 330.0\ncentre: [1.0, -2.0]\nk: [0.0, 0.0]\nfov: 3.1\n"
    return own, json.dumps(info).encode(), mesh.encode()


def shots_file() -> tuple[bytes, ...]:
    """Return the file of a calibration's pictures."""
    shot = "{picture: a.png, pan: 0.1, tilt: 0.3, base_height: 0.93, base_orientation: [0.0, 0.0, 0.0, 1.0]}"
    return (f"robot: {{x: 1.0, y: 0.0, yaw: 0.0}}\npictures:\n- {shot}\n- {shot}\n".encode(),)


def parameter_files() -> tuple[bytes, ...]:
    """Return files of parameters in both forms."""
    return (
        b"vision: {segmentation: {brightness_step: 1.5}, opponents.team_colour: cyan}\nhead:\n  acceleration: 2.0\n"
        b"strategy: {field_turned: true}\nmotion: {gait: dcm, step_time: 0.4}\n",
        b"/**:\n  ros__parameters: {use_sim_time: true}\n/striker/head:\n  ros__parameters:\n"
        b"    acceleration: 2\n    damping: 1e0\n"
        b"user_input: {walk_test_limits: [0.5, 0.2, 1]}\ngame_input:\n  team_number: 25\n  team_colour: cyan\n",
    )


@cache
def learning_files() -> tuple[bytes, ...]:
    """Return a learning file with two situations, and one without any."""
    found = {(1, 0, 0): Situation(np.zeros(MEMORY), np.ones(2)), (1, 0, 1): Situation(np.ones(MEMORY), np.ones(2))}
    return _written("a.npz", lambda path: save(path, OWNER, found)), _written(
        "b.npz", lambda path: save(path, OWNER, {})
    )


@cache
def pictures() -> tuple[bytes, ...]:
    """Return small pictures as PNG, JPEG and progressive JPEG."""
    picture = np.random.default_rng(1).integers(0, 256, (*PICTURE, 3)).astype(np.uint8)
    kinds: tuple[tuple[str, list[int]], ...] = (
        (".png", []), (".jpg", []), (".jpg", [cv2.IMWRITE_JPEG_PROGRESSIVE, 1, cv2.IMWRITE_JPEG_RST_INTERVAL, 2]),
    )  # fmt: skip
    return tuple(cv2.imencode(kind, picture, options)[1].tobytes() for kind, options in kinds)


def heads() -> tuple[bytes, ...]:
    """Return heads of requests for a WebSocket, of browsers and of programs."""
    lines = (
        "GET / HTTP/1.1\r\nHost: localhost:8765\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
    )
    return tuple(
        f"{lines}Sec-WebSocket-Protocol: {protocol}\r\n{origin}\r\n".encode()
        for protocol in ("foxglove.sdk.v1", "foxglove.websocket.v1, foxglove.sdk.v1", "mqtt")
        for origin in ("", "Origin: http://localhost:8080\r\n", "Origin: http://[::1]\r\n", "Origin: http://x.org\r\n")
    )


def answers() -> tuple[bytes, ...]:
    """Return the head of a server's answer."""
    return (
        b"HTTP/1.1 101 Switching Protocols\r\nupgrade: websocket\r\nsec-websocket-protocol: foxglove.sdk.v1\r\n\r\n",
    )


@cache
def wishes() -> tuple[bytes, ...]:
    """Return serialized wishes of users."""
    commands = (
        UserCommand(request=0, strategy="dribble_and_kick"),
        UserCommand(request=3, velocity=[0.1, 0.0, 0.2]),
        UserCommand(request=4, argument="left"),
    )
    return tuple(serialize_message(each) for each in commands)


@cache
def start_poses() -> tuple[bytes, ...]:
    """Return a serialized start pose."""
    message = PoseWithCovarianceStamped()
    message.pose.pose.orientation.w = 1.0
    return (serialize_message(message),)


@cache
def messages() -> dict[str, tuple[bytes, ...]]:
    """Return serialized messages by topic: what a small recording holds."""
    coded = pictures()[1]
    found: dict[str, list[Any]] = {
        topics.ODOMETRY.name: [_stamped(Odometry(child_frame_id="base_link"), k) for k in range(4)],
        topics.JOINT_STATES.name: [_stamped(JointState(name=["a"], position=[0.1]), k) for k in range(4)],
        topics.MOTION_STATE.name: [_stamped(MotionState(notes=["clipped"]), k) for k in range(3)],
        topics.GAME_STATE.name: [_stamped(GameState(), k) for k in range(2)],
        topics.CAMERA_COMPRESSED.name: [_stamped(CompressedImage(format="jpeg", data=array("B", coded)), 1)],
        topics.REPORT.name: [String(data=REPORT)],
    }
    return {name: tuple(bytes(serialize_message(each)) for each in entries) for name, entries in found.items()}


def recording(
    damage: Damage = intact, compression: str = "zstd", checked: bool = True, rng: random.Random | None = None
) -> bytes:
    """Return a small recording that is sound in itself.

    Args:
        damage: Done to the contents alone: to messages, definitions, names, notes and attached files.
        compression: "zstd", "lz4", or "" for none.
        checked: Whether chunks have checksums.
        rng: Chooses to which of them it is done; None for all.
    """

    def maybe(data: bytes) -> bytes:
        return damage(data) if rng is None or rng.random() < 0.05 else data

    def words(text: str) -> str:
        return maybe(text.encode()).decode("utf-8", "replace")

    def write(path: Path) -> None:
        file = McapFile(path)
        chunk = Chunk()
        types = {topic.name: topic.type_name for topic in topics.TOPICS}
        held = [(f"/{name}", types[name], schemas.definition(types[name]), data) for name, data in messages().items()]
        odd = bytes(serialize_message(_stamped(Odometry(), 1)))
        held.append(("/odd", ELSEWHERE, ODD, (odd, bytes(80))))
        for number, (name, type_name, definition, data) in enumerate(held, 1):
            quality = quality_profiles(topics.ODOMETRY.quality)
            schema = Schema(number, maybe(definition.encode()), "ros2msg", words(type_name))
            channel = Channel(number, words(name), "cdr", {"offered_qos_profiles": words(quality)}, number)
            for record in (schema, channel):
                chunk.add_definition(record)
            file.schemas[number], file.channels[number] = schema, channel
            for count, each in enumerate(data):
                chunk.add(number, count, 10**9 + count * 10**7, 10**9, maybe(each))
        content = chunk.content()
        if compression == "zstd":
            file.add_chunk(chunk)
        else:
            packed = bytes(lz4.frame.compress(content)) if compression else content
            span, checksum = (chunk.first, chunk.last), crc32(content) if checked else 0
            file.add_compressed([packed], compression, span, len(content), checksum, chunk.indices)
        file.add_metadata("recording", {"begun": words("2013-06-24"), "seed": words("1")})
        text = maybe(b"head: {max_speed: 2.0, pan_limits: [-1.5, 1.5]}\n")
        file.add_attachment(Attachment(0, 0, f"{PARAMETERS}head.yaml", "text/yaml", text))
        file.finish()

    return _written("a.mcap", write)


@cache
def recordings() -> tuple[bytes, ...]:
    """Return a small recording, packed in each way; where nothing is packed and checked, damages reach the contents."""
    return recording(), recording(compression="lz4"), recording(compression="", checked=False)


@cache
def bag_notes() -> tuple[bytes, ...]:
    """Return metadata.yaml of a recording."""

    def write(path: Path) -> None:
        profiles = quality_profiles(topics.ODOMETRY.quality)
        entries = [FileEntry("a.mcap", 10**9, 2 * 10**9, 5)]
        bag_metadata.write(path.parent, entries, [TopicEntry("/odometry", "nav_msgs/msg/Odometry", profiles, 5)])

    return (_written(bag_metadata.NAME, write),)


def _stamped(message: Any, count: int) -> Any:
    message.header.stamp.sec, message.header.stamp.nanosec = 1, count * 10_000_000
    return message


def _written(name: str, write: Callable[[Path], object]) -> bytes:
    """Return what is written into a file of a name."""
    with tempfile.TemporaryDirectory(dir=SCRATCH) as folder:
        path = Path(folder) / name
        write(path)
        return path.read_bytes()
