"""What one run of Bayesian optimisation is made from; comparison, campaign and notebook all get it here."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import torch
from jaxtyping import Float32

from cluster.optimization import methods
from cluster.optimization.candidates import CandidateTable
from svaedc.bo.candidates import Problem
from svaedc.bo.distribution_features import Densities
from svaedc.bo.features import Latents
from svaedc.bo.loop import Outcome
from svaedc.bo.online import Adjustable
from svaedc.bo.strategies import Method
from svaedc.model.svae_dc import SvaeDc
from workers.episode import FAILED, Episode
from workers.physics import Physics
from workers.randomness import Stream, generator
from workers.setups import Setup

DRAWS: Final = 2
"""The version of how controllers are drawn. 1 drew in float64 and rounded, as campaigns of svaedc 0.1.0 did,
2 draws in float32, as comparisons always did. The two give different controllers of the same seed."""


@dataclass(frozen=True)
class Optimization:
    """Everything that decides a run's controllers, but for what its trials measure.

    Attributes:
        setup: whose controllers are tried.
        method: its name.
        seed: of every draw, at least 0.
        pool_size: controllers that a method with a pool may choose from.
        model: in evaluation mode, its parameters frozen; None for methods that need none.
        draws: version of how controllers are drawn.
        candidates: simulated ones, which the run chooses among; None where its pool is drawn.
        checkpoint: SHA-256 of the model's file, by which candidates know its latent paths; "" without
            candidates or model.
    """

    setup: Setup
    method: str
    seed: int
    pool_size: int
    model: SvaeDc | None = None
    draws: int = DRAWS
    candidates: CandidateTable | None = None
    checkpoint: str = ""

    def initial(self, index: int) -> Float32[np.ndarray, " D"]:
        """The random controller of one of the first trials, which all methods of a seed share.

        Args:
            index: of the trial, from 0.

        Returns:
            A point of the unit cube, [D]; one of the candidates that were drawn, where there are candidates.
        """
        if self.candidates is not None:
            drawn = self.candidates.drawn
            return drawn[generator(self.seed, Stream.INITIAL, 0).permutation(len(drawn))[index % len(drawn)]]
        return self._uniform(generator(self.seed, Stream.INITIAL, index), (self.setup.dimensions,))

    def rng(self, index: int) -> np.random.Generator:
        """What a method may draw from for the trial of that index."""
        return generator(self.seed, Stream.SUGGESTION, index)

    def problem(self) -> Problem:
        """What methods are built for: the pool, and what the model says of it where the method needs one."""
        pool, candidates = self._pool(), self.candidates
        problem = Problem(
            self.setup.dimensions,
            self.setup.objective_limits,
            pool,
            simulated=candidates.outcomes() if candidates else None,
        )
        if self.model is None or not methods.needs_model(self.method):
            return problem
        simulated = candidates.latents(pool, self.checkpoint) if candidates else None
        return replace(
            problem,
            latents=simulated or Latents.of(torch.from_numpy(pool), self.model.latent_means),
            densities=Densities.of(self.model),
            adjustable=Adjustable(self.model),
        )

    def _pool(self) -> Float32[np.ndarray, "n D"]:
        """Random controllers, or candidates; of more than a pool holds, as many drawn from all."""
        rng = generator(self.seed, Stream.POOL, 0)
        if self.candidates is None:
            return self._uniform(rng, (self.pool_size, self.setup.dimensions))
        x = self.candidates.x
        if len(x) <= self.pool_size:
            return x
        return x[np.sort(rng.choice(len(x), self.pool_size, replace=False))]

    def build(self) -> Method:
        """The method, ready to suggest.

        Raises:
            LookupError: there is none of that name.
            ValueError: it lacks its model, or its pool is empty.
        """
        return methods.build(self.method, self.problem())

    def _uniform(self, rng: np.random.Generator, shape: tuple[int, ...]) -> np.ndarray:
        if self.draws == 1:
            return rng.random(shape).astype(np.float32)
        return rng.random(shape, dtype=np.float32)


RollOut = Callable[[np.ndarray, Physics], Episode]
"""It gives the episode of a controller, [D] in the unit cube, under given physics."""


def hidden_physics(setup: Setup, gap: str, seed: int) -> Physics:
    """Draw the physics of one run, once, from the ranges of a gap.

    Args:
        setup: whose physics they are.
        gap: level of the hidden physics, or its ranges written out.
        seed: of the run, at least 0.

    Returns:
        The parameters, by name.
    """
    return setup.gap(gap).draw(generator(seed, Stream.HIDDEN_PHYSICS, 0))


def outcome_of(setup: Setup, episode: Episode) -> Outcome:
    """Say what an episode shows to a method.

    Args:
        setup: whose episode it is.
        episode: of a trial.

    Returns:
        Its outcome; a failed episode has neither an objective nor badness, and says what it failed of.
    """
    if episode.failure is not None:
        return Outcome(math.nan, math.nan, success=False, stop=f"{FAILED}: {episode.failure.reason}")
    return Outcome(f=episode.f, y=episode.y, success=episode.f > setup.success, stop=episode.stop)


def hidden_robot(setup: Setup, roll_out: RollOut, gap: str, seed: int) -> Callable[[np.ndarray], Outcome]:
    """What one run maximises: the setup under hidden physics.

    Args:
        setup: whose controllers are tried.
        roll_out: gives the episode of a controller under given physics.
        gap: level of the hidden physics, or its ranges written out.
        seed: of the run, at least 0.

    Returns:
        A function of a controller, [D] in the unit cube.
    """
    physics = hidden_physics(setup, gap, seed)
    return lambda x: outcome_of(setup, roll_out(x, physics))
