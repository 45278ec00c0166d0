"""Recordings that anybody may have made: their numbers and names are not believed."""

from __future__ import annotations

import struct
import sys
from dataclasses import replace
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from isal.isal_zlib import crc32
from mcap.opcode import Opcode
from mcap.records import ChunkIndex
from rclpy.serialization import serialize_message
from std_msgs.msg import String

from tulip_ros import mcap_file, mcap_scan, schemas, topics
from tulip_ros.bag import Bag
from tulip_ros.cdr import without_gaps
from tulip_ros.decompression import LARGEST, beginning, unpacked
from tulip_ros.errors import BadInputError
from tulip_ros.latched import SPARE, quality_of
from tulip_ros.log_file import Log, LoggedTopic, files_of
from tulip_ros.log_index import DamagedLogError
from tulip_ros.recovery import recover
from tulip_ros.serialized import after_header, time_at

BOMB = 2**26  # [B] that some kilobytes unpack to


def recording(folder: Path, messages: int = 3) -> Path:
    bag = Bag(folder, free=0)
    bag.add_topic("/said", "std_msgs/msg/String", topics.STATE)
    for number in range(messages):
        bag.write("/said", serialize_message(String(data=f"number {number}")), 1000 + number)
    bag.close()
    return bag.path


def packed(compression: str) -> bytes:
    content = bytes(BOMB)
    return zstandard.ZstdCompressor().compress(content) if compression == "zstd" else lz4.frame.compress(content)


@pytest.mark.parametrize("compression", ["zstd", "lz4"])
def test_a_chunk_unpacks_to_no_more_than_it_says(compression: str) -> None:
    data = packed(compression)
    assert len(data) < BOMB // 200
    with pytest.raises(ValueError, match="holds more than the 1000 bytes it should"):
        unpacked(data, compression, 1000, 0)
    assert len(beginning(data, compression, 1000)) == 1000
    assert unpacked(data, compression, BOMB, crc32(bytes(BOMB))) == bytes(BOMB)


def test_a_chunk_larger_than_any_recorder_writes_is_refused_before_it_is_unpacked() -> None:
    with pytest.raises(ValueError, match="expected at most"):
        unpacked(packed("zstd"), "zstd", LARGEST + 1, 0)


def test_an_index_that_names_a_chunk_twice_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    encode = mcap_file.encode
    monkeypatch.setattr(mcap_file, "encode", lambda it: encode(it) * (2 if isinstance(it, ChunkIndex) else 1))
    with pytest.raises(DamagedLogError):
        Log(recording(tmp_path / "a"))


@pytest.mark.parametrize("place", [2**63 - 1, 2**64 - 1, 0])
def test_an_index_that_leads_out_of_the_file_is_told(
    place: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    encode = mcap_file.encode
    monkeypatch.setattr(
        mcap_file,
        "encode",
        lambda it: encode(replace(it, chunk_start_offset=place) if isinstance(it, ChunkIndex) else it),
    )
    with Log(recording(tmp_path / "a")) as log, pytest.raises(DamagedLogError):
        list(log.records())


def test_metadata_names_files_in_its_own_folder_alone(tmp_path: Path) -> None:
    secret = recording(tmp_path / "secret")
    own = recording(tmp_path / "own")
    for names in ([str(secret), "../secret/secret.mcap"], ["x" * 5000], ["a\0b"], [3], "own.mcap", {"a": 1}):
        (own.parent / "metadata.yaml").write_text(f"rosbag2_bagfile_information: {{relative_file_paths: {names!r}}}")
        assert files_of(own.parent) == [own]


def test_a_type_whose_definition_is_not_installed_is_not_imported() -> None:
    assert "this" not in sys.modules
    for name in ("this/msg/Zen", "os/path/system", "../msg/Thing", "a/msg/../../b", "std_msgs/msg/" + "A" * 5000, "x"):
        with pytest.raises(LookupError):
            schemas.message_class(name)
    assert "this" not in sys.modules


@pytest.mark.parametrize(
    "quality", ["[" * 1000, "[{depth: 1e400, durability: 1}]", "[{depth: 999999999}]", "{a: 1}", "3"]
)
def test_a_quality_of_service_that_cannot_be_is_left_out(quality: str) -> None:
    found = quality_of(LoggedTopic("/odd", "pkg/msg/Odd", "", 1, quality))
    assert found.depth == SPARE.depth


def test_counts_in_a_message_do_not_lead_behind_its_end() -> None:
    count = struct.pack("<4sI", b"\0\1\0\0", 2**32 - 1)  # of structures
    with pytest.raises(ValueError, match="no tf2_msgs/msg/TFMessage"):
        without_gaps("tf2_msgs/msg/TFMessage", count)
    for data in (b"", b"\0", b"\0\1\0\0\0"):
        for act in (time_at, after_header, lambda it: without_gaps("std_msgs/msg/String", it)):
            with pytest.raises(ValueError):
                act(data)


def test_a_mended_recording_has_no_broken_chunk_in_it(tmp_path: Path) -> None:
    path = recording(tmp_path / "a")
    data = bytearray(path.read_bytes())
    [chunk] = [found for found in mcap_scan.scan(bytes(data), 8) if found.opcode == Opcode.CHUNK]
    head = mcap_scan.chunk_head(bytes(data), chunk.begin)
    assert head is not None
    content = mcap_scan.chunk_content(bytes(data), head)
    assert content is not None
    last = [begin for opcode, begin, _ in mcap_scan.records(content) if opcode == Opcode.MESSAGE][-1]
    broken = bytearray(content)
    struct.pack_into("<Q", broken, last - 8, 2**40)  # its length leads out of the chunk, whose checksum is right
    file = mcap_file.McapFile(tmp_path / "b.mcap")
    with Log(path) as log:
        summary = log._files[0].summary
    file.schemas, file.channels = dict(summary.schemas), dict(summary.channels)
    file.add_compressed([bytes(broken)], "", head.span, len(broken), crc32(bytes(broken)), {})
    file.abandon()  # as when its recorder was killed
    with pytest.raises(BadInputError):
        Log(file.path)
    output = recover(file.path).output
    assert output is not None
    with Log(output) as log:
        assert [log.decode(record).data for record in log.records()] == ["number 0", "number 1"]
