"""Damaged recordings: what is whole comes back, the rest is told, and nothing is written over."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import recover as script
from mcap.opcode import Opcode
from mcap.reader import make_reader
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader
from std_msgs.msg import String
from typer.testing import CliRunner

from tulip_ros import bag, mcap_scan, recovery, topics
from tulip_ros.log_file import Log
from tulip_ros.log_index import DamagedLogError
from tulip_ros.mcap_file import McapFile

TOPIC = "/words"
STEP = 10_000_000  # [ns] between messages


@pytest.fixture(autouse=True)
def no_sync(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Power stays on here."""
    monkeypatch.setattr(os, "fdatasync", lambda number: None)
    monkeypatch.setattr(os, "fsync", lambda number: None)
    yield


def make(folder: Path, chunks: int, monkeypatch: pytest.MonkeyPatch, each: int = 3) -> Path:
    """Write a recording of so many chunks and return its file."""
    monkeypatch.setattr(bag, "CHUNK", 10**9)
    recording = bag.Bag(folder, free=0)
    recording.note("recording", {"seed": "7"})
    recording.attach("robot.yaml", "text/yaml", b"mass: 23")
    recording.add_topic(TOPIC, "std_msgs/msg/String", topics.STATE)
    for number in range(chunks * each):
        data = serialize_message(String(data=f"number {number} {hash(str(number * 7)) % 10**6}"))
        recording.write(TOPIC, data, 1000 + number * STEP, 900 + number * STEP)
        if number % each == each - 1:
            recording._push()
    recording.close()
    return recording.path


def chunks_of(data: bytes) -> list[mcap_scan.Found]:
    return [found for found in mcap_scan.scan(data, 8) if found.opcode == Opcode.CHUNK]


def texts(folder: Path) -> list[bytes]:
    with Log(folder) as log:
        return [record.data for record in log.records()]


def test_every_whole_chunk_comes_back_wherever_the_file_is_cut(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    source = make(tmp_path / "whole", 3, monkeypatch)
    data, written = source.read_bytes(), texts(source)
    ends = [found.end for found in chunks_of(data)]
    cut, saved = tmp_path / "cut.mcap", tmp_path / "saved.mcap"
    for length in range(1, len(data)):
        cut.write_bytes(data[:length])
        with ExitStack() as stack:
            damaged = recovery._Source(cut, stack, lambda count: None)
            assert damaged.saved.damages, length
            file = McapFile(saved)
            recovery._copy(damaged, file, lambda count: None)
            file.finish()
        with open(saved, "rb") as stream:
            found = [message.data for _, _, message in make_reader(stream).iter_messages()]
        saved.unlink()
        assert found == written[: len(found)] and len(found) >= 3 * sum(end <= length for end in ends), length


@pytest.mark.parametrize("beyond", [-1, 0, 1])
def test_cuts_at_the_edges_of_chunks_make_readable_recordings(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beyond: int
):
    source = make(tmp_path / "whole", 3, monkeypatch)
    data, written = source.read_bytes(), texts(source)
    for number, found in enumerate(chunks_of(data)):
        cut = tmp_path / f"cut_{number}.mcap"
        cut.write_bytes(data[: found.end + beyond])
        if number == 0 and beyond < 0:
            continue  # the edge of what the types are in: tested above
        output = recovery.recover(cut).output
        assert output is not None
        saved = texts(output)
        assert saved == written[: len(saved)] and len(saved) >= 3 * (number + (beyond >= 0))


def test_garbage_in_the_middle_costs_the_chunks_that_it_hits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(bag, "DEFINE", 4)
    source = make(tmp_path / "hit", 12, monkeypatch)
    data, written = bytearray(source.read_bytes()), texts(source)
    chunks = chunks_of(bytes(data))
    data[chunks[2].begin + 60 : chunks[2].begin + 70] = b"\xff" * 10  # inside
    data[chunks[7].begin - 3 : chunks[8].begin + 5] = os.urandom(chunks[8].begin + 5 - chunks[7].begin + 3)
    source.write_bytes(data)
    with pytest.raises(DamagedLogError, match=r"recover\.py"), Log(source.parent) as log:
        list(log.records())
    result = recovery.recover(source.parent)
    assert result.output == tmp_path / "hit_recovered"
    assert texts(result.output) == written[:6] + written[9:21] + written[27:]
    assert result.files[0].lost == {TOPIC: 9}
    assert source.read_bytes() == bytes(data)


def test_types_lost_with_the_first_chunk_are_found_again_later(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(bag, "DEFINE", 4)
    source = make(tmp_path / "head", 12, monkeypatch)
    written = texts(source)
    data = bytearray(source.read_bytes())
    chunks = chunks_of(bytes(data))
    data[chunks[0].begin + 50] ^= 0xFF
    source.write_bytes(data[: chunks[10].begin])
    result = recovery.recover(source.parent)
    assert result.output is not None and texts(result.output) == written[3:30]
    assert result.files[0].lost == {TOPIC: 3}


def test_notes_attachments_times_and_metadata_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    source = make(tmp_path / "killed", 4, monkeypatch)
    data = source.read_bytes()
    source.write_bytes(data[: chunks_of(data)[3].begin])
    (source.parent / "metadata.yaml").unlink()
    output = recovery.recover(source).output
    assert output == tmp_path / "killed_recovered"
    with Log(output) as log:
        assert log.metadata["recording"] == {"seed": "7"}
        assert recovery.NEVER_ENDED in log.metadata[recovery.RECOVERED]["damage"]
        assert [(each.name, each.data) for each in log.attachments()] == [("robot.yaml", b"mass: 23")]
        assert log.span == (1000, 1000 + 8 * STEP)
    with AnyReader([output]) as reader:
        assert [stamp for _, stamp, _ in reader.messages()] == [1000 + n * STEP for n in range(9)]


def test_metadata_alone_may_be_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    source = make(tmp_path / "bare", 2, monkeypatch)
    (source.parent / "metadata.yaml").unlink()
    output = recovery.recover(source.parent).output
    assert output is not None and (output / "metadata.yaml").exists()
    assert texts(output) == texts(source)


def test_all_files_of_a_split_recording_are_mended(tmp_path: Path):
    recording = bag.Bag(tmp_path / "long", bag.Split(seconds=0.1), free=0)
    recording.add_topic(TOPIC, "std_msgs/msg/String", topics.LATCHED)
    for number in range(30):
        recording.write(TOPIC, serialize_message(String(data=str(number))), number * STEP)
    recording.close()
    written = texts(recording.folder)
    assert len(recording.paths) == 3 and len(written) == 30
    last = recording.paths[-1]
    last.write_bytes(last.read_bytes()[:-20])
    result = recovery.recover(recording.folder)
    assert result.output is not None and texts(result.output) == written
    assert [bool(each.damages) for each in result.files] == [False, False, True]


def test_a_recording_of_another_program_is_mended(tmp_path: Path):
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(tmp_path / "other", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        topic = writer.add_connection(TOPIC, "std_msgs/msg/String", typestore=store)
        for number in range(4000):
            writer.write(topic, number * STEP, serialize_message(String(data="x" * 400 + str(number))))
    source = tmp_path / "other" / "other.mcap"
    written = texts(source)
    source.write_bytes(source.read_bytes()[: source.stat().st_size // 2])
    output = recovery.recover(source).output
    assert output is not None
    saved = texts(output)
    assert saved == written[: len(saved)] and len(saved) > 1500  # of the cut chunk, too: it is not compressed


def invoke(*arguments: str) -> tuple[int, str]:
    import typer

    app = typer.Typer()
    app.command()(script.main)
    result = CliRunner().invoke(app, list(arguments))
    return result.exit_code, " ".join(result.output.split())


def test_script_says_what_was_saved_and_replaces_only_when_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    source = make(tmp_path / "trial", 4, monkeypatch)
    assert invoke(str(source.parent)) == (0, f"{source.parent} is whole: there is nothing to mend.")
    data = source.read_bytes()
    source.write_bytes(data[: chunks_of(data)[3].begin + 20])
    code, words = invoke(str(source.parent))
    assert code == 0 and "saved 9 messages over 0.08 s" in words and "1 notes, 1 attached files" in words
    code, words = invoke(str(source.parent))
    assert code == 2 and "--force" in words
    (tmp_path / "trial_recovered" / "precious.txt").touch()
    code, words = invoke(str(source.parent), "--force")
    assert code == 2 and "precious.txt" in words
    (tmp_path / "trial_recovered" / "precious.txt").unlink()
    assert invoke(str(source.parent), "--force")[0] == 0
    code, words = invoke(str(source.parent), "--output", str(tmp_path / "mended"))
    assert code == 0 and len(texts(tmp_path / "mended")) == 9
    assert source.read_bytes() == data[: chunks_of(data)[3].begin + 20]


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 no recording", b"\x89MCAP0\r\n"])
def test_a_file_without_any_message_is_refused(tmp_path: Path, content: bytes):
    (tmp_path / "x.mcap").write_bytes(content)
    code, words = invoke(str(tmp_path / "x.mcap"))
    assert code == 2 and words.startswith("error: Nothing can be saved")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.mcap"]
    assert "There is no recording" in invoke(str(tmp_path / "none"))[1]
