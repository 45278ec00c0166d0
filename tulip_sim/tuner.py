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
import signal
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass, fields
from pathlib import Path

import optuna
from optuna.storages import JournalStorage
from optuna.storages.journal import JournalFileBackend
from optuna.trial import TrialState

from tulip_motion.gait_file import PATH as GAIT
from tulip_motion.gait_file import read_gait, write_gait
from tulip_sim.tuning import SPACE, Figures, check_names, evaluate

STUDY = "gait"
SETTINGS = "settings"
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
            self._study = optuna.create_study(
                storage=storage, study_name=STUDY, load_if_exists=True, sampler=optuna.samplers.TPESampler(seed=0)
            )
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
        # Each worker is one single-threaded process: more threads would only wait for each other.
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        workers = min(workers or os.cpu_count() or 1, max(trials, 1))
        running: dict[Future[Figures], optuna.trial.Trial] = {}
        pool = ProcessPoolExecutor(workers, initializer=_ignore_interrupts)
        left = trials
        try:
            while left or running:
                while left and len(running) < workers:
                    trial, left = self._study.ask(), left - 1
                    running[pool.submit(evaluate, self._values(trial, names), self._seeds, self.settings.seconds)] = (
                        trial
                    )
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

    def best(self) -> tuple[float, Figures, dict[str, float]]:
        """Return cost, figures and all gait parameters of the best trial.

        Raises:
            StudyError: if no trial has finished.
        """
        if not self.finished:
            raise StudyError(f"Study {self._path} holds no finished trial; run some first.")
        trial = self._study.best_trial
        figures = Figures(**{name: float(trial.user_attrs[name]) for name in FIGURES})
        return float(trial.value or 0.0), figures, {**self.settings.base, **trial.params}

    def apply(self, path: Path = GAIT) -> None:
        """Write the best gait into a gait file.

        Raises:
            StudyError: if there is none, or the file cannot be written.
        """
        cost, figures, values = self.best()
        rounded = {name: float(f"{value:.4g}") for name, value in values.items()}
        provenance = (
            "",
            f"Best of {self.finished} gaits, each judged by walks of {self.settings.seconds:g} s forward, sideways,",
            f"backward, turning, starting and stopping, and by pushes, in {self.settings.seeds} random worlds each",
            f"(tulip_sim/tuning.py): cost {cost:.3f}; "
            + ", ".join(f"{name.replace('_', ' ')} {value:.3f}" for name, value in figures.as_dict().items()),
        )
        try:
            write_gait(path, rounded, provenance)
        except OSError as error:
            raise StudyError(f"Gait file {path} cannot be written: {error.strerror}. Name another file.") from error

    @property
    def _seeds(self) -> range:
        return range(self.settings.seeds)

    def _give_back(self, number: int, values: dict[str, float]) -> None:
        """Leave a trial that was broken off to be tried again."""
        self._study.tell(number, state=TrialState.FAIL)
        self._study.enqueue_trial(values)

    def _values(self, trial: optuna.trial.Trial, names: Sequence[str]) -> dict[str, float]:
        searched = {name: trial.suggest_float(name, *SPACE[name]) for name in names}
        return {**self.settings.base, **searched}


def default_settings(seeds: int, seconds: float) -> TuningSettings:
    """Return settings that start from the committed gait."""
    return TuningSettings(seeds, seconds, read_gait(GAIT))


def _ignore_interrupts() -> None:
    """Leave Ctrl-C to the process that keeps the study."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
