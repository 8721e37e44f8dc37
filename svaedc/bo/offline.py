"""What a model is worth for Bayesian optimisation, cheaply: runs whose candidates are recorded episodes.

Nothing is simulated: trying a held-out controller shows the objective that its episode had. It is a proxy:
the pool is small, and each controller has its own physics instead of a run's hidden one.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float32

from svaedc.bo import methods
from svaedc.bo.candidates import Problem
from svaedc.bo.features import LatentMeans, Latents
from svaedc.bo.loop import Outcome, trials

INITIAL = 2
"""All methods of a run share so many random trials, as in a comparison."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """Episodes that no training has seen.

    Attributes:
        x: Controllers in the unit cube.
        f: Objective of each.
        limits: Objectives that count as 0 and 1.
    """

    x: Float32[np.ndarray, "n D"]
    f: Float32[np.ndarray, " n"]
    limits: tuple[float, float]

    def outcome(self, x: Float32[np.ndarray, " D"]) -> Outcome:
        """What the episode of this controller showed.

        Raises:
            ValueError: None was recorded.
        """
        [rows] = np.nonzero((self.x == x).all(axis=1))
        if not len(rows):
            raise ValueError(f"x must be a recorded controller, got {x}; search the pool only")
        return Outcome(f=float(self.f[rows[0]]), y=float("nan"), success=False)


@dataclass(frozen=True)
class Worth:
    """Means over runs.

    Attributes:
        best: Best objective after the last trial.
        mean: Objective of the suggested trials.
    """

    best: float
    mean: float


def worth(method: str, recorded: Recorded, latent_means: LatentMeans, runs: int, count: int) -> Worth:
    """How a method fares on recorded episodes with the latents of a model.

    Args:
        method: Name of a method that searches a pool.
        recorded: The candidates of every run.
        latent_means: Of the model.
        runs: Each has other random first trials; the same for every method and model.
        count: Trials the method suggests.

    Returns:
        Means over all runs.
    """
    pool = torch.from_numpy(recorded.x)
    latents = Latents.of(pool, latent_means)
    problem = Problem(recorded.x.shape[1], recorded.limits, recorded.x, latents)
    records = [_run(method, problem, recorded, run, count) for run in range(runs)]
    return Worth(
        float(np.mean([each[-1] for each in records])), float(np.mean([each[:-1] for each in records]))
    )


def _run(method: str, problem: Problem, recorded: Recorded, run: int, count: int) -> list[float]:
    """Objectives of the suggested trials of one run, and the best of all at the end."""
    first = recorded.x[np.random.default_rng((run, 0)).choice(len(recorded.x), INITIAL, replace=False)]
    records = list(
        trials(
            methods.build(method, problem),
            recorded.outcome,
            first,
            count,
            lambda index: np.random.default_rng((run, 1, index)),
            lambda: 0.0,
        )
    )
    return [*(trial.f for trial in records[INITIAL:]), records[-1].best]
