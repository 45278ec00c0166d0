"""Who plays the jobs: processes of this machine, or a Ray cluster."""

from __future__ import annotations

import multiprocessing
import os
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from tulip_ros.errors import BadInputError
from tulip_sim.batch.jobs import Batch, Job, Row, run_job
from tulip_sim.interrupts import left_to_this_process

AHEAD = 2  # jobs handed out for each worker: one to work on, one to go on with
WATCH = 0.5  # [s] between two looks at whether the process that hands out jobs still lives
RAY_HINT = "Install the extra: pip install 'tulip-soccer[ray]'"


def play_here(batch: Batch, jobs: Sequence[Job], workers: int | None = None) -> Iterator[Row]:
    """Yield the row of each job as it comes, played by processes of this machine.

    Args:
        batch: What is played.
        jobs: Which of its jobs.
        workers: Processes; all cores by default.

    Raises:
        BadInputError: if a process ends that should not, as when memory runs out.
    """
    count = min(workers or os.cpu_count() or 1, max(1, len(jobs)))
    # Each worker is one single-threaded process: more threads would only wait for each other.
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    context = multiprocessing.get_context("spawn")  # a progress bar's thread may hold locks that a fork would copy
    pool = ProcessPoolExecutor(count, context, _begin_work, (os.getpid(),))
    left = iter(jobs)
    running: set[Future[Row]] = set()
    try:
        while True:
            while len(running) < AHEAD * count and (job := next(left, None)) is not None:
                with left_to_this_process():
                    running.add(pool.submit(run_job, batch.play, batch.scenario, batch.sets[job.parameters], job))
            if not running:
                break
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    except BrokenProcessPool as error:
        raise BadInputError(
            "A process of the batch ended that should not have: memory may have run out. What was played is kept; run "
            "the same command again, with fewer --workers."
        ) from error
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
        for child in multiprocessing.active_children():
            child.terminate()  # games under way are played again next time


def play_on_ray(batch: Batch, jobs: Sequence[Job], address: str) -> Iterator[Row]:
    """Yield the row of each job as it comes, played by a Ray cluster.

    Args:
        batch: What is played.
        jobs: Which of its jobs.
        address: Of the cluster, as `ray.init` takes it; its machines must have this project installed.

    Raises:
        BadInputError: if Ray is not installed or the cluster cannot be reached.
    """
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    try:
        import ray
    except ImportError as error:
        raise BadInputError(f"--ray needs the package ray. {RAY_HINT}") from error
    try:
        ray.init(address=address, log_to_driver=False, logging_level="ERROR", configure_logging=False)
    except (ConnectionError, ValueError, RuntimeError, OSError) as error:
        what = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise BadInputError(f"There is no Ray cluster at {address!r}: {what}") from error
    try:
        count = int(ray.cluster_resources().get("CPU", 1))
        remote = ray.remote(num_cpus=1)(run_job)
        sets = {name: ray.put(settings) for name, settings in batch.sets.items()}
        left = iter(jobs)
        running: list[Any] = []
        while True:
            while len(running) < AHEAD * count and (job := next(left, None)) is not None:
                running.append(remote.remote(batch.play, batch.scenario, sets[job.parameters], job))
            if not running:
                break
            done, running = ray.wait(running)
            for reference in done:
                yield ray.get(reference)
    finally:
        ray.shutdown()


def _begin_work(parent: int) -> None:
    """Prepare a process for work: without its parent there is nothing to work for."""
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(WATCH)
    os._exit(1)
