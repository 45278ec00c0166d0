"""The gait tuner: optuna's search over `tuning.SPACE`, on all cores, in a file that can be gone on with.

One process alone asks and tells the study and writes its file; the others only walk. A study keeps what it was
begun with (seeds, lengths, the gait that it started from), so that all of its trials can be compared; a change of
the walking code asks for a new study.
"""

from __future__ import annotations

import json
import logging
import multiprocessing
import os
import warnings
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import asdict, astuple, dataclass, fields
from pathlib import Path

import numpy as np
import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import TrialState

from tulip_motion.gait_file import PATH as GAIT
from tulip_motion.gait_file import read_gait, write_gait
from tulip_sim.interrupts import left_to_this_process
from tulip_sim.tuning import SPACE, Figures, check_names, evaluate

STUDY = "gait"
SETTINGS = "settings"
CONFIRMED = "confirmed"
CANDIDATES = 3  # of the best gaits that are judged again
UNSEEN = 2  # times as many worlds for that as for a trial
SPREAD = 0.08  # of the range of each parameter: standard deviation of the first gaits round the base
FIGURES = [field.name for field in fields(Figures)]


class StudyError(Exception):
    """A study cannot be used; the message says why and what to do."""


@dataclass(frozen=True)
class TuningSettings:
    """What all trials of a study have in common.

    Attributes:
        seeds: How many worlds each gait walks in.
        seconds: Length of each walk [s].
        base: The gait that the search starts from: all parameters by name.
    """

    seeds: int
    seconds: float
    base: dict[str, float]


@dataclass(frozen=True)
class Judged:
    """A gait and how good it was.

    Attributes:
        figures: See there.
        values: All gait parameters by name.
        unseen: Whether it was judged in worlds that no trial had seen.
    """

    figures: Figures
    values: dict[str, float]
    unseen: bool


class Tuner:
    """A study of gaits in a file.

    Attributes:
        settings: What the study was begun with.
    """

    def __init__(self, path: Path, settings: TuningSettings) -> None:
        """Open a study, or begin one.

        Args:
            path: The study's file, optuna's journal.
            settings: For a new study; one that exists has to have the same seeds and seconds, and keeps its base.

        Raises:
            StudyError: if the file cannot be read or written, is no study, or one with other settings.
        """
        optuna.logging.set_verbosity(logging.WARNING)
        self._path = path
        try:
            storage = JournalStorage(JournalFileBackend(str(path)))
            self._study = optuna.create_study(storage=storage, study_name=STUDY, load_if_exists=True)
            known = self._study.user_attrs.get(SETTINGS)
            trials = self._study.trials
        except OSError as error:
            raise StudyError(f"Study {path} cannot be opened: {error.strerror}. Name another file.") from error
        except (json.JSONDecodeError, UnicodeDecodeError, KeyError, TypeError, ValueError, AssertionError) as error:
            raise StudyError(
                f"Study {path} is damaged or no study ({type(error).__name__}: {error}). Move it away, or name another."
            ) from error
        if known is None:
            self._study.set_user_attr(SETTINGS, {**asdict(settings), "figures": FIGURES})
            self._study.enqueue_trial(settings.base)  # the first trial is the gait that has to be beaten
            self.settings = settings
        elif known.get("figures") != FIGURES:
            raise StudyError(f"Study {path} judged gaits by other figures than this code does. Begin another study.")
        else:
            self.settings = TuningSettings(int(known["seeds"]), float(known["seconds"]), dict(known["base"]))
            if (self.settings.seeds, self.settings.seconds) != (settings.seeds, settings.seconds):
                raise StudyError(
                    f"Study {path} was begun with --seeds {self.settings.seeds} --seconds {self.settings.seconds:g};"
                    " trials with others cannot be compared. Give these, or begin another study."
                )
        outside = [name for name, (low, high) in SPACE.items() if not low <= self.settings.base[name] <= high]
        if outside:
            raise StudyError(f"The gait to start from lies outside the bounds of tuning.py in {', '.join(outside)}.")
        self._study.sampler = _sampler(self.settings.base)
        for trial in trials:  # of a process that was killed
            if trial.state is TrialState.RUNNING:
                self._give_back(trial.number, trial.params)

    @property
    def finished(self) -> int:
        """How many trials the study holds."""
        return len(self._study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,)))

    def run(
        self, trials: int, names: Sequence[str], workers: int | None, done: Callable[[float, Figures], None]
    ) -> None:
        """Add trials; an interrupt ends it; the trials under way are tried again next time.

        Args:
            trials: How many.
            names: Parameters to search over; all others keep the value of the study's base.
            workers: Processes; all cores by default.
            done: Told of the cost and figures of each trial.

        Raises:
            ValueError: if a name cannot be tuned.
            KeyboardInterrupt: after all that was finished has been kept.
        """
        check_names(names)
        self._study.set_user_attr(CONFIRMED, {})  # there will be better ones
        # Each worker is one single-threaded process: more threads would only wait for each other.
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        workers = min(workers or os.cpu_count() or 1, max(trials, 1))
        running: dict[Future[Figures], optuna.trial.Trial] = {}
        pool = ProcessPoolExecutor(workers)
        left = trials
        try:
            while left or running:
                while left and len(running) < workers:
                    trial, left = self._study.ask(), left - 1
                    values = self._values(trial, names)
                    with left_to_this_process():
                        future = pool.submit(evaluate, values, self._seeds, self.settings.seconds)
                    running[future] = trial
                for future in wait(running, return_when=FIRST_COMPLETED).done:
                    figures, trial = future.result(), running[future]
                    for name, value in figures.as_dict().items():
                        trial.set_user_attr(name, value)
                    self._study.tell(trial, figures.cost)
                    del running[future]
                    done(figures.cost, figures)
        finally:
            for trial in running.values():
                self._give_back(trial.number, trial.params)
            if running:
                for process in multiprocessing.active_children():
                    process.terminate()
            pool.shutdown(cancel_futures=True)

    def best(self) -> Judged:
        """Return the best gait: of those judged in unseen worlds, if there are any, else of all.

        Raises:
            StudyError: if no trial has finished.
        """
        if not self.finished:
            raise StudyError(f"Study {self._path} holds no finished trial; run some first.")
        confirmed: dict[str, list[float]] = self._study.user_attrs.get(CONFIRMED, {})
        if confirmed:
            number, judged = min(confirmed.items(), key=lambda item: Figures(*item[1]).cost)
            return Judged(Figures(*judged), self._gait(self._study.trials[int(number)]), True)
        trial = self._study.best_trial
        figures = Figures(**{name: float(trial.user_attrs[name]) for name in FIGURES})
        return Judged(figures, self._gait(trial), False)

    def confirm(self, workers: int | None, done: Callable[[int, int], None]) -> None:
        """Judge the best gaits again, and the one that the search started from, in worlds that no trial has seen.

        The best of many trials is partly the luckiest in their worlds.

        Args:
            workers: Processes; all cores by default.
            done: Told how many judgements of how many are made.
        """
        complete = self._study.get_trials(deepcopy=False, states=(TrialState.COMPLETE,))
        chosen = {complete[0].number: complete[0]} | {
            trial.number: trial for trial in sorted(complete, key=lambda trial: trial.value or 0.0)[:CANDIDATES]
        }
        seeds = range(self.settings.seeds, (1 + UNSEEN) * self.settings.seeds)
        tasks = [(number, seed) for number in chosen for seed in seeds]
        figures: dict[int, list[Figures]] = {number: [] for number in chosen}
        with ProcessPoolExecutor(workers or os.cpu_count() or 1) as pool:
            with left_to_this_process():
                judging = [
                    pool.submit(evaluate, self._gait(chosen[number]), (seed,), self.settings.seconds)
                    for number, seed in tasks
                ]
            for count, (future, (number, _)) in enumerate(zip(judging, tasks, strict=True), 1):
                figures[number].append(future.result())
                done(count, len(tasks))
        means = {
            str(number): np.mean([list(astuple(each)) for each in judged], axis=0).tolist()
            for number, judged in figures.items()
        }
        self._study.set_user_attr(CONFIRMED, means)

    def apply(self, path: Path = GAIT) -> None:
        """Write the best gait into a gait file.

        Raises:
            StudyError: if there is none, or the file cannot be written.
        """
        best = self.best()
        rounded = {name: float(f"{value:.4g}") for name, value in best.values.items()}
        worlds = f"{UNSEEN * self.settings.seeds} that none had seen before" if best.unseen else "the same worlds"
        provenance = (
            "",
            f"Best of {self.finished} gaits, each judged by walks of {self.settings.seconds:g} s forward, sideways,",
            f"backward, turning, starting and stopping, and by pushes, in {self.settings.seeds} random worlds each",
            "(tulip_sim/tuning.py).",
            f"In {worlds} it cost {best.figures.cost:.3f}: "
            + ", ".join(f"{name.replace('_', ' ')} {value:.3f}" for name, value in best.figures.as_dict().items()),
        )
        try:
            write_gait(path, rounded, provenance)
        except OSError as error:
            raise StudyError(f"Gait file {path} cannot be written: {error.strerror}. Name another file.") from error

    @property
    def _seeds(self) -> range:
        return range(self.settings.seeds)

    def _gait(self, trial: optuna.trial.FrozenTrial) -> dict[str, float]:
        return {**self.settings.base, **trial.params}

    def _give_back(self, number: int, values: dict[str, float]) -> None:
        """Leave a trial that was broken off to be tried again."""
        self._study.tell(number, state=TrialState.FAIL)
        self._study.enqueue_trial(values)

    def _values(self, trial: optuna.trial.Trial, names: Sequence[str]) -> dict[str, float]:
        searched = {name: trial.suggest_float(name, *SPACE[name]) for name in names}
        return {**self.settings.base, **searched}


def _sampler(base: dict[str, float]) -> optuna.samplers.BaseSampler:
    """Return CMA-ES round a gait: most gaits of the whole space fall at once, and say nothing about better ones."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FutureWarning)  # optuna 6 will drop x0
        return optuna.samplers.CmaEsSampler(x0=dict(base), sigma0=SPREAD, n_startup_trials=1, seed=0)


def default_settings(seeds: int, seconds: float) -> TuningSettings:
    """Return settings that start from the committed gait."""
    return TuningSettings(seeds, seconds, read_gait(GAIT))
