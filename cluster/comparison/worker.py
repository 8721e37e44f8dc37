"""What one worker of a comparison does: hidden physics, shared first trials, a method, trial after trial."""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from ray import tune

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.comparison.robot import HiddenRobot, safe_attempts
from cluster.files import DISK_ERRORS
from cluster.optimization import methods
from cluster.optimization.candidates import shared_candidates
from cluster.optimization.factory import Optimization, hidden_physics
from cluster.optimization.models import shared_model
from svaedc.bo.loop import Trial, trials
from workers import setups
from workers.attempts import TIMEOUT_SECONDS, Attempts
from workers.dataset.shards import sha256
from workers.hardware import robots
from workers.setups import Setup

STEP_SECONDS = 1.0
"""A worker reports after so long: a user sees that as live, and any robot makes some trials in it."""


@dataclass(frozen=True)
class ComparisonJob:
    """What all runs of a comparison share.

    Attributes:
        folder: of the results.
        setup: its name.
        gap: level of the hidden physics, or its ranges written out.
        models: checkpoints; none when no method needs one. With several, runs take turns.
        pool_size: candidates of each run.
        initial: random trials that all methods of a seed share.
        trials: suggested trials after them.
        episode_timeout: longest duration of a trial, in s.
        candidates: file of simulated candidates that all runs choose among; "" for none.
    """

    folder: ComparisonFolder
    setup: str
    gap: str
    models: tuple[str, ...]
    pool_size: int
    initial: int
    trials: int
    episode_timeout: float = TIMEOUT_SECONDS
    candidates: str = ""

    @property
    def length(self) -> int:
        """Trials of a whole run."""
        return self.initial + self.trials

    def require(self, names: Sequence[str], setup: Setup) -> None:
        """Refuse what every run of one of these methods would fail of, before anything starts.

        Args:
            names: of the methods.
            setup: whose controllers are tried.

        Raises:
            ValueError: a method lacks what it needs, or its pool would run dry.
        """
        neediest = max(names, key=methods.needs_model)
        for turn in range(max(1, len(self.models))):
            # What the neediest needs holds what the others need as well.
            problem = self.optimization(RunKey(neediest, turn), setup).problem()
            for name in names:
                methods.require(name, problem, self.trials)

    def run(self, key: RunKey, setup: Setup, attempts: Attempts) -> Iterator[Trial]:
        """Try what a run still has to try.

        Args:
            key: of the run.
            setup: whose controllers are tried.
            attempts: rolls them out; every run of a process may use the same.

        Yields:
            The missing trials, in order; each is on disk before it is yielded.
        """
        planned, earlier = self.optimization(key, setup), self.folder.trials(key)
        physics = hidden_physics(setup, self.gap, key.run)
        initial = np.stack([planned.initial(index) for index in range(self.initial)])
        with safe_attempts(self.folder, key, len(earlier), attempts, self.episode_timeout) as safe:
            robot = HiddenRobot(self.folder, key, setup, physics, safe, next=len(earlier))
            for trial in trials(
                planned.build(), robot.evaluate, initial, self.trials, planned.rng, time.monotonic, earlier
            ):
                self.folder.append(key, trial)
                yield trial
        self.folder.end(key)

    def optimization(self, key: RunKey, setup: Setup) -> Optimization:
        """What decides the controllers of a run.

        Args:
            key: of the run.
            setup: whose controllers are tried.

        Returns:
            With the model whose turn it is, if the run's method needs one.
        """
        candidates = shared_candidates(Path(self.candidates)) if self.candidates else None
        planned = Optimization(setup, key.method, key.run, self.pool_size, candidates=candidates)
        if not methods.needs_model(key.method):
            return planned
        path = Path(self.models[key.run % len(self.models)])
        model = shared_model(path, self.setup, robots.stands_in_for(self.setup))
        return replace(planned, model=model, checkpoint=sha256(path) if candidates else "")


class RunTrainable(tune.Trainable):
    """One run as Ray Tune sees it; the actor is reused for the next run.

    A step is all trials that begin within `STEP_SECONDS`: Tune's own work for a step, a twentieth of a second
    of one core, would otherwise be a third of a short trial's.
    """

    def setup(self, config: dict[str, Any]) -> None:
        """Start the simulation, which all runs of this actor share, and the first run."""
        torch.set_num_threads(1)
        self._setup = setups.load(config["job"].setup)
        self._attempts = Attempts(self._setup, config["job"].episode_timeout)
        self.reset_config(config)

    def reset_config(self, new_config: dict[str, Any]) -> bool:
        """Begin another run."""
        self._key = RunKey(**new_config["run"])
        self._trials = new_config["job"].run(self._key, self._setup, self._attempts)
        self._length = new_config["job"].length
        return True

    def step(self) -> dict[str, Any]:
        """The next trials, or why the disk takes none; trying again would not help there."""
        try:
            made = list(self._next())
        except OSError as error:
            if error.errno not in DISK_ERRORS:
                raise
            return {"disk": str(error), "done": True}
        if not made:  # the record was whole before this attempt
            return {"done": True}
        return {"trials": len(made), "best": made[-1].best, "done": made[-1].index + 1 >= self._length}

    def _next(self) -> Iterator[Trial]:
        end = time.monotonic() + STEP_SECONDS
        for trial in self._trials:
            yield trial
            if time.monotonic() >= end:
                return

    def save_checkpoint(self, checkpoint_dir: str) -> None:
        """Nothing to save: every trial is already in the run's record."""

    def load_checkpoint(self, checkpoint: dict[str, Any] | None) -> None:
        """Nothing to load: a run continues from its record."""

    def cleanup(self) -> None:
        """End the simulation."""
        self._attempts.close()
