"""Mends recordings that were cut or damaged: all that is whole goes into a new recording beside, the rest is told."""

from __future__ import annotations

import errno
import shutil
from array import array
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from io import BytesIO
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Header, Metadata, Schema, Statistics

from tulip_ros import bag_metadata, mcap_scan
from tulip_ros.bag_metadata import FileEntry, TopicEntry
from tulip_ros.errors import BadInputError
from tulip_ros.log_edit import making_room
from tulip_ros.log_file import REPEATED, Log, files_of
from tulip_ros.log_index import DAMAGES
from tulip_ros.mcap_file import LIBRARY, MAGIC, Chunk, McapFile
from tulip_ros.mcap_scan import Data, Found

Advance = Callable[[int], None]
"""Is told how many bytes were worked on since the last time."""

RECOVERED = "recovered"
"""Note in a recording that was mended: what was lost. Also ends its folder's name."""
LOOSE = 2**20  # [B] of messages outside of chunks that make a chunk
NEVER_ENDED = "was not ended: its recorder was killed, or the end is cut off"


@dataclass
class Saved:
    """What came of one file.

    Attributes:
        source: The file.
        damages: What was wrong, in words.
        messages: Saved, by topic.
        lost: Known to be lost, by topic; what a cut took at the end nobody knows.
        first, last: Log times of the first and the last saved message [ns].
        damaged_bytes: That could not be used.
        metadata: Notes saved.
        attachments: Attached files saved.
    """

    source: Path
    damages: list[str] = field(default_factory=list)
    messages: dict[str, int] = field(default_factory=dict)
    lost: dict[str, int] = field(default_factory=dict)
    first: int = 0
    last: int = 0
    damaged_bytes: int = 0
    metadata: int = 0
    attachments: int = 0


@dataclass(frozen=True)
class Recovery:
    """What came of a recording: the new one, or None where nothing was to be mended; and each file's result."""

    output: Path | None
    files: tuple[Saved, ...]


def recover(
    path: Path, output: Path | None = None, force: bool = False, advance: Advance = lambda count: None
) -> Recovery:
    """Mend a recording.

    Args:
        path: Its folder, or one file of it.
        output: Folder for the new recording; None for one beside, whose name ends in _recovered.
        force: Replace a recording that is in that folder.
        advance: For a progress bar over twice the size of all files.

    Raises:
        BadInputError: if there is nothing that could be saved, or the new recording cannot be written.
    """
    paths = files_of(path)
    output = output or _beside(path)
    try:
        with ExitStack() as stack:
            sources = [_Source(each, stack, advance) for each in paths]
            has_metadata = path.is_file() or (path / bag_metadata.NAME).is_file()
            saved = tuple(each.saved for each in sources)
            if has_metadata and not any(each.damages for each in saved):
                return Recovery(None, saved)
            if not any(each.chunks for each in sources):
                reasons = "; ".join(f"{each.source.name} {', '.join(each.damages)}" for each in saved)
                raise BadInputError(f"Nothing can be saved of {path}: it holds no whole message ({reasons}).")
            with making_room(output, force, paths):
                _write(sources, output, advance)
    except OSError as error:
        raise BadInputError(
            f"{path} cannot be recovered to {output}: {error.strerror or error}. "
            "Make room, or name another folder with --output."
        ) from error
    return Recovery(output, saved)


class _Source:
    """A damaged file: what is whole in it."""

    def __init__(self, path: Path, stack: ExitStack, advance: Advance) -> None:
        self.saved = Saved(path)
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.pieces: list[Found] = []
        """Chunks, loose messages, notes and attachments in turn, and where the end of the file cuts a chunk."""
        self.chunks = 0
        self._statistics: Statistics | None = None
        self._last: dict[int, int] = {}  # sequence number of each channel's last message
        self._gaps: dict[int, int] = {}  # messages missing between, by channel
        self._first_number: int | None = None
        self.data: Data = b""
        stream = stack.enter_context(open(path, "rb"))
        if path.stat().st_size:
            self.data = stack.enter_context(mmap(stream.fileno(), 0, access=ACCESS_READ))
        self._examine(advance)

    def channel_is_known(self, number: int) -> bool:
        """Return whether a channel's messages can be read."""
        return number in self.channels and self.channels[number].schema_id in (0, *self.schemas)

    def damage(self, begin: int, end: int, what: str) -> None:
        """Note a part that cannot be used."""
        self.saved.damages.append(what)
        self.saved.damaged_bytes += end - begin

    def see(self, channel: int, sequence: int) -> None:
        """Take the number of a message that is saved: gaps show what is lost."""
        before = self._last.get(channel, self._first_number)
        if before is not None and sequence > before + 1:
            self._gaps[channel] = self._gaps.get(channel, 0) + sequence - before - 1
        self._last[channel] = max(sequence, self._last.get(channel, sequence))

    def count_lost(self, counts: Mapping[int, int]) -> None:
        """Note how many messages are lost: by the file's own index where that is whole, else by their numbers."""
        for number, channel in self.channels.items():
            lost = self._gaps.get(number, 0)
            if self._statistics is not None:
                lost = self._statistics.channel_message_counts.get(number, 0) - counts.get(number, 0)
            if lost > 0:
                self.saved.lost[channel.topic] = self.saved.lost.get(channel.topic, 0) + lost

    def _examine(self, advance: Advance) -> None:
        data, place = self.data, len(MAGIC)
        if not data:
            self.damage(0, 0, "is empty")
            return
        if data[: len(MAGIC)] != MAGIC:
            place = 0
            self.damage(0, 0, "does not begin as an MCAP file does")
        advance(place)
        ended = False
        for found in mcap_scan.scan(data, place):
            self._see_record(found)
            ended = ended or (found.opcode == Opcode.FOOTER and data[found.end : found.end + len(MAGIC)] == MAGIC)
            advance(found.end - found.begin)
        if not ended:
            self.saved.damages.append(NEVER_ENDED)
        elif not self.saved.damages:
            try:
                Log(self.saved.source).close()
            except BadInputError as error:
                self.saved.damages.append(f"has a damaged index ({error.__cause__ or error})")

    def _see_record(self, found: Found) -> None:
        data, opcode = self.data, found.opcode
        if opcode is None:
            head = mcap_scan.chunk_head(data, found.begin)
            if found.end == len(data) and head is not None:
                cut = mcap_scan.cut_content(data, head)
                if any(each == Opcode.MESSAGE for each, _, _ in mcap_scan.records(cut)):
                    self.pieces.append(found)
                    self.chunks += 1
                self._define(cut)
            self.damage(found.begin, found.end, f"bytes {found.begin} to {found.end} are no whole record")
        elif opcode == Opcode.CHUNK:
            head = mcap_scan.chunk_head(data, found.begin)
            content = None if head is None else mcap_scan.chunk_content(data, head)
            if content is None:
                self.damage(found.begin, found.end, f"bytes {found.begin} to {found.end} are a damaged chunk")
                return
            self._define(content)
            self.pieces.append(found)
            self.chunks += 1
        elif opcode in (Opcode.MESSAGE, Opcode.ATTACHMENT, Opcode.METADATA):
            self.pieces.append(found)
            self.chunks += opcode == Opcode.MESSAGE
            note = read(Metadata, data, found) if opcode == Opcode.METADATA else None
            if note is not None and note.name == REPEATED:
                self._first_number = None  # the file goes on where another one ended
        elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            self._define(bytes(data[found.begin : found.end]))
        elif opcode == Opcode.STATISTICS:
            self._statistics = read(Statistics, data, found)
        elif opcode == Opcode.HEADER:
            header = read(Header, data, found)
            if header is not None and header.library == LIBRARY:
                self._first_number = -1  # messages are numbered from 0 on

    def _define(self, content: bytes) -> None:
        for opcode, begin, end in mcap_scan.records(content):
            whole = Found(opcode, begin - mcap_scan.HEAD.size, end)
            if opcode == Opcode.SCHEMA:
                schema = read(Schema, content, whole)
                if schema is not None and _is_text(schema.data):
                    self.schemas.setdefault(schema.id, schema)
            elif opcode == Opcode.CHANNEL:
                channel = read(Channel, content, whole)
                if channel is not None:
                    self.channels.setdefault(channel.id, channel)


def read(kind: Any, data: Data, found: Found) -> Any:
    """Return a record of a kind of `mcap.records`, or None if its lengths lead out of it or its text is none."""
    try:
        return kind.read(ReadDataStream(BytesIO(data[found.begin + mcap_scan.HEAD.size : found.end])))
    except DAMAGES:
        return None


def _write(sources: Sequence[_Source], output: Path, advance: Advance) -> None:
    """Write what is whole into a new recording, which appears once it is complete."""
    folder = output.with_name(f"{output.name}.part")
    size = sum(len(source.data) for source in sources)
    output.parent.mkdir(parents=True, exist_ok=True)
    if shutil.disk_usage(output.parent).free < size:
        raise OSError(errno.ENOSPC, f"{size / 1e6:.0f} MB are needed")
    if folder.exists():
        shutil.rmtree(folder)  # of a recovery that was interrupted
    folder.mkdir()
    try:
        files: list[FileEntry] = []
        counts: dict[str, TopicEntry] = {}
        filled = [source for source in sources if source.chunks]
        for number, source in enumerate(filled):
            name = f"{output.name}_{number}.mcap" if len(filled) > 1 else f"{output.name}.mcap"
            file = McapFile(folder / name)
            try:
                _copy(source, file, advance)
                file.finish()
            finally:
                file.abandon()
            files.append(FileEntry(name, file.first, file.last, file.messages))
            source.saved.first, source.saved.last = file.first, file.last
            for number, channel in file.channels.items():
                count = file.counts.get(number, 0)
                source.saved.messages[channel.topic] = source.saved.messages.get(channel.topic, 0) + count
                entry = counts.get(channel.topic)
                type_name = file.schemas[channel.schema_id].name if channel.schema_id else ""
                quality = channel.metadata.get("offered_qos_profiles", "")
                sofar = 0 if entry is None else entry.messages
                counts[channel.topic] = TopicEntry(channel.topic, type_name, quality, sofar + count)
        bag_metadata.write(folder, files, list(counts.values()))
        folder.rename(output)
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _copy(source: _Source, file: McapFile, advance: Advance) -> None:
    """Write all that is whole in one file into another one."""
    data = source.data
    file.add_definitions([*source.schemas.values()])
    file.add_definitions([each for each in source.channels.values() if source.channel_is_known(each.id)])
    loose = Chunk()
    for found in source.pieces:
        if found.opcode != Opcode.MESSAGE and loose.messages:
            file.add_chunk(loose)
            loose = Chunk()
        if found.opcode == Opcode.METADATA:
            metadata = read(Metadata, data, found)
            file.add_metadata(metadata.name, metadata.metadata)
            source.saved.metadata += 1
        elif found.opcode == Opcode.ATTACHMENT:
            file.add_attachment(read(Attachment, data, found))
            source.saved.attachments += 1
        elif found.opcode == Opcode.MESSAGE:
            _take(source, bytes(data[found.begin : found.end]), loose)
            if loose.size > LOOSE:
                file.add_chunk(loose)
                loose = Chunk()
        else:
            _copy_chunk(source, found, file)
        advance(found.end - found.begin)
    if loose.messages:
        file.add_chunk(loose)
    source.count_lost(file.counts)
    saved = source.saved
    values = {"from": saved.source.name, "damage": "; ".join(saved.damages), "damaged bytes": str(saved.damaged_bytes)}
    values.update({f"lost of {topic}": str(count) for topic, count in saved.lost.items()})
    file.add_metadata(RECOVERED, values)


def _copy_chunk(source: _Source, found: Found, file: McapFile) -> None:
    """Write a chunk as it is; where that cannot be, what is whole in it."""
    head = mcap_scan.chunk_head(source.data, found.begin)
    assert head is not None  # as when it was examined
    content = mcap_scan.chunk_content(source.data, head) if found.opcode == Opcode.CHUNK else None
    if content is None:
        chunk = Chunk()
        _take(source, mcap_scan.cut_content(source.data, head), chunk)
        if chunk.messages:
            file.add_chunk(chunk)
        return
    indices: dict[int, array[int]] = {}
    numbers: list[tuple[int, int]] = []
    sound, place = True, 0
    for opcode, begin, end in mcap_scan.records(content):
        place = end
        if opcode == Opcode.MESSAGE:
            message = mcap_scan.message_head(content, begin, end)
            if message is None:
                sound = False
                continue
            channel, sequence, log_time, _ = message
            indices.setdefault(channel, array("Q")).extend((log_time, begin - mcap_scan.HEAD.size))
            numbers.append((channel, sequence))
    if sound and place == len(content) and all(map(source.channel_is_known, indices)):
        for channel, sequence in numbers:
            source.see(channel, sequence)
        held = bytes(source.data[head.data : head.data + head.length])
        file.add_compressed([held], head.compression, head.span, head.size, head.checksum, indices)
        return
    chunk = Chunk()
    _take(source, content, chunk)
    if chunk.messages:
        file.add_chunk(chunk)


def _take(source: _Source, content: bytes, chunk: Chunk) -> None:
    """Put all messages that can be read into a chunk."""
    for opcode, begin, end in mcap_scan.records(content):
        message = mcap_scan.message_head(content, begin, end) if opcode == Opcode.MESSAGE else None
        if message is None:
            continue
        channel, sequence, log_time, publish_time = message
        if source.channel_is_known(channel):
            chunk.add(channel, sequence, log_time, publish_time, content[begin + mcap_scan.MESSAGE.size : end])
            source.see(channel, sequence)
        else:
            topic = f"channel {channel}, whose topic and type are lost"
            source.saved.lost[topic] = source.saved.lost.get(topic, 0) + 1


def _is_text(data: bytes) -> bool:
    try:
        data.decode()
    except UnicodeDecodeError:
        return False
    return True


def _beside(path: Path) -> Path:
    """Return a folder for the new recording: beside the old one, or beside a file that belongs to none."""
    path = path.absolute()
    belongs = path.is_file() and path.stem.startswith(path.parent.name)
    base = path.parent.with_name(path.stem) if belongs else path.with_suffix("") if path.is_file() else path
    return base.with_name(f"{base.name}_{RECOVERED}")
