"""How fast the recorder's writer takes messages, beside rosbags' writer, in turns in one process."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray
from rclpy.serialization import serialize_message
from sensor_msgs.msg import JointState

from tulip_ros import schemas, topics
from tulip_ros.bag import Bag
from tulip_ros.log_file import Log
from tulip_sim.bench.log_trial import record_trial
from tulip_sim.bench.runner import Row
from tulip_sim.messages import jpeg_to_message
from tulip_vision.messages import picture_to_message

ROUNDS = 5
SMALL, PICTURES, RAW_PICTURES = 100_000, 5_000, 600
UNIQUE = 20_000  # small messages: 14 MB, so that none comes twice in one chunk
TRIAL = (1, 20.0)  # seed and length [s] of the trial that the pictures come from: 312 of them
COLLECTED = 30  # messages that the recorder takes at one time during a match
JPEG, RAW = topics.CAMERA_COMPRESSED, topics.CAMERA_IMAGE


def measure(kind: str) -> Row:
    """Write the same messages with each writer in turn.

    Args:
        kind: "small messages" (joint states of the 14 joints, with noise), "pictures" (of a trial, as JPEG) or
            "raw pictures" (the same as they are).
    """
    messages, topic = MAKERS[kind]()
    writers: dict[str, Callable[[Path, list[bytes], topics.Topic], None]] = {
        f"{name}{suffix}": partial(write, compressed=bool(suffix))
        for suffix in (" zstd", "")
        for name, write in (
            ("ours", partial(_ours, sync=True)),
            ("ours not kept", partial(_ours, sync=False)),
            ("rosbags kept", _rosbags_kept),
            ("rosbags", _rosbags),
        )
    }
    times: dict[str, list[float]] = {name: [] for name in writers}
    sizes: dict[str, int] = {}
    with tempfile.TemporaryDirectory(prefix="tulip_log_") as scratch:
        for _ in range(ROUNDS):
            for name, write in writers.items():
                folder = Path(scratch) / "bag"
                begin = time.perf_counter()
                write(folder, messages, topic)
                times[name].append(time.perf_counter() - begin)
                sizes[name] = sum(file.stat().st_size for file in folder.glob("*.mcap"))
                shutil.rmtree(folder)
    size = sum(map(len, messages))
    row: Row = {"part": "throughput", "kind": kind, "messages": len(messages), "bytes each": size // len(messages)}
    for name, spent in times.items():
        row[f"{name} [1/s]"] = round(len(messages) / float(np.median(spent)))
        row[f"{name} [MB/s]"] = round(size / 1e6 / float(np.median(spent)), 1)
        row[f"{name} [MB written]"] = round(sizes[name] / 1e6, 1)
    return row


def _joint_states() -> tuple[list[bytes], topics.Topic]:
    rng = np.random.default_rng(1)
    names = [f"joint_{number}_of_the_leg" for number in range(14)]
    values = rng.normal(size=(UNIQUE, 3, 14)).round(4).tolist()
    data = [serialize_message(JointState(name=names, position=p, velocity=v, effort=e)) for p, v, e in values]
    return _repeated(data, SMALL), topics.JOINT_STATES


def _pictures() -> tuple[list[bytes], topics.Topic]:
    return _repeated([serialize_message(jpeg_to_message(picture, 0)) for picture in _trial()], PICTURES), JPEG


def _raw_pictures() -> tuple[list[bytes], topics.Topic]:
    return _repeated([serialize_message(picture_to_message(picture, 0)) for picture in _trial()], RAW_PICTURES), RAW


def _trial() -> list[NDArray[np.uint8]]:
    """Return the (480, 640, 3) pictures of a trial."""
    with tempfile.TemporaryDirectory(prefix="tulip_log_") as scratch:
        folder = Path(scratch) / "trial"
        record_trial(folder, "png", *TRIAL)
        with Log(folder) as log:
            coded = [log.decode(record).data for record in log.records([f"/{JPEG.name}"])]
    return [np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR), np.uint8) for data in coded]


def _repeated(data: list[bytes], count: int) -> list[bytes]:
    return [data[number % len(data)] for number in range(count)]


MAKERS = {"small messages": _joint_states, "pictures": _pictures, "raw pictures": _raw_pictures}


def _ours(folder: Path, messages: list[bytes], topic: topics.Topic, compressed: bool, sync: bool) -> None:
    bag = Bag(folder, free=0, compression="zstd" if compressed else "none", sync=sync)
    bag.add_topic(f"/{topic.name}", topic.type_name, topic.quality)
    for number, data in enumerate(messages):
        bag.write(f"/{topic.name}", data, number * 1_000_000)
        if number % COLLECTED == 0:
            bag.flush()
    bag.close()


def _rosbags(folder: Path, messages: list[bytes], topic: topics.Topic, compressed: bool) -> None:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    writer = Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP)
    if compressed:
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
    with writer:
        definition = schemas.definition(topic.type_name)
        connection = writer.add_connection(f"/{topic.name}", topic.type_name, msgdef=definition, rihs01="RIHS01_0")
        for number, data in enumerate(messages):
            writer.write(connection, number * 1_000_000, data)


def _rosbags_kept(folder: Path, messages: list[bytes], topic: topics.Topic, compressed: bool) -> None:
    """Have the disk keep what rosbags wrote, as ours does."""
    _rosbags(folder, messages, topic, compressed)
    for path in folder.glob("*.mcap"):
        with path.open("rb") as file:
            os.fdatasync(file.fileno())
