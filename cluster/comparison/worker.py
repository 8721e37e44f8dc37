"""What one worker of a comparison does: hidden physics, shared first trials, a method, trial after trial."""

import errno
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from ray import tune

from cluster.comparison.records import RunKey, append, read_trials
from svaedc.bo import methods
from svaedc.bo.candidates import Problem
from svaedc.bo.distribution_features import Densities
from svaedc.bo.features import Latents
from svaedc.bo.loop import Outcome, Trial, trials
from svaedc.bo.online import Adjustable
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc
from workers import setups
from workers.environments.environment import Environment
from workers.randomness import generator
from workers.rollout import rollout
from workers.setups import Setup

STEP_SECONDS = 1.0
"""After which a worker reports: what a user sees as live, and some trials of any robot."""
_DISK = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EFBIG}


@dataclass(frozen=True)
class ComparisonJob:
    """What all runs of a comparison share.

    Attributes:
        folder: of the results.
        setup: its name.
        gap: level of the hidden physics, or its ranges written out.
        model: checkpoint; "" when no method needs one.
        pool_size: candidates of each run.
        initial: random trials that all methods of a seed share.
        trials: suggested trials after them.
    """

    folder: Path
    setup: str
    gap: str
    model: str
    pool_size: int
    initial: int
    trials: int

    @property
    def length(self) -> int:
        """Trials of a whole run."""
        return self.initial + self.trials

    def require(self, names: Sequence[str], setup: Setup) -> None:
        """Refuse what every run of one of these methods would fail of, with a `ValueError`."""
        neediest = max(names, key=methods.needs_model)
        problem = self._problem(RunKey(neediest, 0), setup)  # holds what the others need as well
        for name in names:
            methods.require(name, problem, self.trials)

    def run(self, key: RunKey, setup: Setup, environment: Environment) -> Iterator[Trial]:
        """The missing trials of a run; each is on disk before it is yielded."""
        path = key.path(self.folder)
        draws = (generator(key.run, "initial", index) for index in range(self.initial))
        first = [draw.random(setup.dimensions, dtype=np.float32) for draw in draws]
        for trial in trials(
            methods.build(key.method, self._problem(key, setup)),
            evaluation(setup, environment, self.gap, key.run),
            np.stack(first),
            self.trials,
            lambda index: generator(key.run, "suggestion", index),
            time.monotonic,
            read_trials(path),
        ):
            append(path, trial)
            yield trial

    def _problem(self, key: RunKey, setup: Setup) -> Problem:
        pool = generator(key.run, "pool", 0).random((self.pool_size, setup.dimensions), dtype=np.float32)
        if not methods.needs_model(key.method):
            return Problem(setup.dimensions, setup.objective_limits, pool)
        model = _model(self.model)
        latents = Latents.of(torch.from_numpy(pool), model.latent_means)
        return Problem(
            setup.dimensions, setup.objective_limits, pool, latents, Densities.of(model), Adjustable(model)
        )


def evaluation(setup: Setup, environment: Environment, gap: str, run: int) -> Callable[[np.ndarray], Outcome]:
    """What one run maximises: the setup under hidden physics, drawn once from the gap's ranges."""
    physics = setup.gap(gap).draw(generator(run, "hidden-physics", 0))

    def evaluate(x: np.ndarray) -> Outcome:
        episode = rollout(setup, environment, x, physics)
        return Outcome(f=episode.f, y=episode.y, success=episode.f > setup.success, stop=episode.stop)

    return evaluate


@cache
def _model(path: str) -> SvaeDc:
    """Loaded once in a process, however many runs it does."""
    model, _ = checkpoint.load(Path(path))
    return model.requires_grad_(requires_grad=False)


class RunTrainable(tune.Trainable):
    """One run as Ray Tune sees it; the actor is reused for the next run.

    A step is all trials that begin within `STEP_SECONDS`: Tune's own work for a step, a twentieth of a second
    of one core, would otherwise be a third of a short trial's.
    """

    def setup(self, config: dict[str, Any]) -> None:
        """Start the simulation, which all runs of this actor share, and the first run."""
        torch.set_num_threads(1)
        self._setup = setups.load(config["job"].setup)
        self._environment = self._setup.open()
        self.reset_config(config)

    def reset_config(self, new_config: dict[str, Any]) -> bool:
        """Begin another run."""
        self._key = RunKey(**new_config["run"])
        self._trials = new_config["job"].run(self._key, self._setup, self._environment)
        self._length = new_config["job"].length
        return True

    def step(self) -> dict[str, Any]:
        """The next trials, or why the disk takes none; trying again would not help there."""
        try:
            made = list(self._next())
        except OSError as error:
            if error.errno not in _DISK:
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
        self._environment.close()
