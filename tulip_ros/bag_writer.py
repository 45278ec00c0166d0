"""Compresses and writes chunks beside the program that records, which must never wait for a disk."""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from tulip_ros.mcap_file import Chunk, McapFile

WAITING = 64  # jobs: half a minute of a match, or 40 MB of chunks; who gives more work has to wait
SYNC = 0.1  # [s] at least between two times that the disk is told to keep what was written; chunks come every 0.5 s

Job = Callable[[McapFile], None]


class BagWriter:
    """Writes one file after the other, in a thread of its own.

    A second thread waits while the disk keeps what was written. After an error nothing more is written; the file then
    ends with a whole record, and can be recovered.
    """

    def __init__(self) -> None:
        """Prepare; the thread starts with the first job."""
        self.error: OSError | None = None
        """Why writing ended early."""
        self._jobs: queue.Queue[tuple[Job, McapFile] | None] = queue.Queue(WAITING)
        self._thread: threading.Thread | None = None
        self._keeper = ThreadPoolExecutor(1, "recording_sync")
        self._keeping: Future[None] | None = None
        self._synced = time.monotonic()

    def chunk(self, file: McapFile, chunk: Chunk) -> None:
        """Write a chunk; it must not be changed any more."""

        def write(to: McapFile) -> None:
            to.add_chunk(chunk)
            if time.monotonic() - self._synced > SYNC and (self._keeping is None or self._keeping.done()):
                self._settle()
                self._keeping = self._keeper.submit(to.sync)
                self._synced = time.monotonic()

        self._put(file, write)

    def do(self, file: McapFile, job: Job) -> None:
        """Do something with a file when all that was asked for before is done.

        Raises:
            OSError: if writing ended early.
        """

        def settled(to: McapFile) -> None:
            self._settle()
            job(to)

        self._put(file, settled)

    def check(self) -> None:
        """Tell of an error of the thread.

        Raises:
            OSError: if writing ended early.
        """
        if self.error is not None:
            raise self.error

    def close(self) -> None:
        """Wait until all is written.

        Raises:
            OSError: if writing ended early.
        """
        if self._thread is not None:
            self._jobs.put(None)
            self._thread.join()
            self._thread = None
        self._keeper.shutdown()
        self.check()

    def _put(self, file: McapFile, job: Job) -> None:
        self.check()
        if self._thread is None:
            self._thread = threading.Thread(target=self._work, name="recording", daemon=True)
            self._thread.start()
        self._jobs.put((job, file))

    def _settle(self) -> None:
        """Wait until the disk has what it was told to keep.

        Raises:
            OSError: if it refused.
        """
        if self._keeping is not None:
            self._keeping.result()
            self._keeping = None

    def _work(self) -> None:
        while (entry := self._jobs.get()) is not None:
            job, file = entry
            if self.error is None:
                try:
                    job(file)
                except OSError as error:
                    self.error = error
                    with contextlib.suppress(OSError):
                        file.sync()
