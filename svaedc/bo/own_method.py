"""A method of a user's own: what it must offer, and what is checked of what it suggests."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float32

from svaedc.bo.candidates import Problem
from svaedc.bo.history import History
from svaedc.bo.strategies import Method


@runtime_checkable
class MethodFactory(Protocol):
    """A class or function that makes a method for one run; it is what a user names.

    One that uses the latents, densities or adjustable layers of a trained model has the attribute
    `needs_model = True`: its problems hold them, and commands demand a model for it. Without that attribute
    they hold none.

    Example:
        >>> class Greedy:
        ...     def __init__(self, problem):
        ...         self.pool = problem.pool
        ...     def suggest(self, history, rng):
        ...         if not len(history):
        ...             return rng.choice(self.pool)
        ...         best = history.x[history.f.argmax()]
        ...         return np.clip(best + 0.1 * rng.normal(size=best.shape), 0, 1)
    """

    def __call__(self, problem: Problem) -> Method:
        """The method of one run."""
        ...


@dataclass(frozen=True)
class OwnMethod:
    """A user's method, whose suggestions are checked and rounded as those of all methods are.

    Attributes:
        name: under which it was asked for.
        method: the user's.
        dimensions: D, the number of controller parameters.
    """

    name: str
    method: Method
    dimensions: int

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """Ask the user's method.

        Args:
            history: Trials of the run so far.
            rng: Generator of the trial.

        Returns:
            Its controller, [D], in float32, so that a run goes on from its records as if it never stopped.

        Raises:
            ValueError: It suggests something else than D numbers in [0, 1].
        """
        suggested = self.method.suggest(history, rng)
        x = np.array(suggested, dtype=np.float32)
        if x.shape != (self.dimensions,):
            raise ValueError(
                f"method {self.name!r} must suggest {self.dimensions} numbers, shape ({self.dimensions},), "
                f"got shape {x.shape}"
            )
        outside = np.flatnonzero(~((x >= 0) & (x <= 1)))
        if outside.size:
            raise ValueError(
                f"method {self.name!r} must suggest numbers in [0, 1], got {x[outside[0]]} in place "
                f"{outside[0]}; clip them with np.clip(x, 0, 1)"
            )
        return x
