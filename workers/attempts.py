"""Episodes whose code raises cost themselves and nothing else; one that hangs ends its process."""

import faulthandler
import math
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Iterable
from contextlib import suppress
from types import TracebackType
from typing import Any, Final

import numpy as np

from workers.controllers.controller import unit_cube
from workers.environments.environment import Environment
from workers.episode import Episode, Failure
from workers.physics import Physics
from workers.rollout import failed_episode, rollout
from workers.setups import Setup
from workers.user_code import describe, full_traceback

TIMEOUT_SECONDS: Final = 120.0
"""An episode that takes longer hangs, unless a caller knows better."""

_MACHINE_ERRORS = (OSError, MemoryError)
"""These are troubles of the machine, and no fault of a controller: they are passed on."""


Case = tuple[np.ndarray, Physics]
"""It is rolled out: a controller, [D] in [0, 1], and a value for every physics parameter by name."""


class SafeRollouts(ABC):
    """Rolls out controllers of one setup; whatever their code does, each gives an episode.

    One that fails is tried once more where no episode was before it: what an earlier one left behind is not
    its fault.

    Args:
        setup: whose controllers are rolled out.

    Attributes:
        setup: whose controllers are rolled out.
    """

    def __init__(self, setup: Setup) -> None:
        self.setup = setup

    def rollout(self, x: np.ndarray, physics: Physics) -> Episode:
        """Roll out one controller.

        Args:
            x: the controller, [D], in [0, 1].
            physics: a value for every parameter of the setup, by name.

        Returns:
            The episode, as `rollouts` gives it.
        """
        return self.rollouts([(x, physics)])[0]

    def rollouts(self, cases: Iterable[Case]) -> list[Episode]:
        """Roll out controllers, one after the other.

        Args:
            cases: controllers and their physics.

        Returns:
            An episode for each; those that failed say of what.

        Raises:
            ValueError: x is no controller of the setup.
            OSError: the machine is in trouble; so does MemoryError.
        """
        return [self._attempt(unit_cube(x, self.setup.dimensions), physics) for x, physics in cases]

    def _attempt(self, x: np.ndarray, physics: Physics) -> Episode:
        was_fresh = self._is_fresh
        made = self._try(x, physics)
        if isinstance(made, Episode):
            return made
        return failed_episode(self.setup, x, physics, made) if was_fresh else self._attempt(x, physics)

    @property
    @abstractmethod
    def _is_fresh(self) -> bool:
        """Whether nothing was rolled out since the environment was opened; so it is after a failure."""

    @abstractmethod
    def _try(self, x: np.ndarray, physics: Physics) -> Episode | Failure:
        """The episode, or why there is none."""

    @abstractmethod
    def close(self) -> None:
        """End the simulation, if there is one."""

    def __enter__(self) -> "SafeRollouts":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


class Attempts(SafeRollouts):
    """Rolls out in this process, in an environment that is opened anew after something raised in it.

    An episode that takes too long ends this process, for code that hangs cannot be broken off from within:
    its traceback goes to `words`, and `workers.isolation` finds out which episode it was.

    Args:
        setup: whose controllers are rolled out.
        timeout: longest duration of an episode, in s.
        words: open file for the traceback of one that hangs.
    """

    def __init__(self, setup: Setup, timeout: float = TIMEOUT_SECONDS, words: Any = sys.__stderr__) -> None:
        super().__init__(setup)
        self._watchdog = Watchdog(timeout, words)
        self._environment: Environment | None = None

    def rollouts(self, cases: Iterable[Case]) -> list[Episode]:
        """Roll out controllers, one after the other; see `SafeRollouts.rollouts`."""
        with self._watchdog:
            return super().rollouts(cases)

    @property
    def _is_fresh(self) -> bool:
        return self._environment is None

    def _try(self, x: np.ndarray, physics: Physics) -> Episode | Failure:
        self._watchdog.watch()
        try:
            if self._environment is None:
                self._environment = self.setup.open()
            return rollout(self.setup, self._environment, x, physics)
        except _MACHINE_ERRORS:
            raise
        except (Exception, SystemExit) as error:  # noqa: BLE001 - users' code may raise anything
            self.close()
            return Failure(describe(error), full_traceback(error))

    def close(self) -> None:
        """End the simulation, if there is one."""
        environment, self._environment = self._environment, None
        if environment is not None:
            with suppress(Exception):  # it has been given up already
                environment.close()


class Watchdog:
    """Ends the process, with a traceback of its threads, when no episode has begun for too long.

    The standard library does it in C and needs no lock of Python's: code that hangs in C is ended too. It
    takes a millisecond to set, so that it is set anew only after a tenth of its time. It watches from the
    first `watch` in a `with` block to the end of that.

    Args:
        seconds: longest duration of an episode.
        words: open file for the traceback.
    """

    def __init__(self, seconds: float = TIMEOUT_SECONDS, words: Any = sys.__stderr__) -> None:
        self._seconds = seconds
        self._words = words
        self._set = -math.inf

    def watch(self) -> None:
        """An episode begins."""
        now = time.monotonic()
        if now - self._set > self._seconds / 10:
            self._set = now
            faulthandler.dump_traceback_later(self._seconds * 1.1, exit=True, file=self._words)

    def __enter__(self) -> "Watchdog":
        """Episodes follow."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """No episode is under way."""
        self._set = -math.inf
        faulthandler.cancel_dump_traceback_later()
