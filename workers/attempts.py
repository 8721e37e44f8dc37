"""Episodes whose code raises cost themselves and nothing else; one that hangs ends its process."""

import faulthandler
import math
import sys
import time
from collections.abc import Iterable
from contextlib import suppress
from types import TracebackType
from typing import Any, Final

import numpy as np

from workers.controllers.controller import unit_cube
from workers.environments.environment import Environment
from workers.physics import Physics
from workers.rollout import Episode, Failure, failed_episode, rollout
from workers.setups import Setup
from workers.user_code import describe, full_traceback

TIMEOUT_SECONDS: Final = 120.0
"""An episode that takes longer hangs, unless a caller knows better."""

_MACHINE_ERRORS = (OSError, MemoryError)
"""These are troubles of the machine, and no fault of a controller: they are passed on."""


Case = tuple[np.ndarray, Physics]
"""It is rolled out: a controller, [D] in [0, 1], and a value for every physics parameter by name."""


class Attempts:
    """Rolls out in this process; an episode that raises is tried once more in an environment opened anew.

    An episode that takes too long ends this process, for code that hangs cannot be broken off from within:
    its traceback goes to `words`, and `workers.isolation` finds out which episode it was.

    Args:
        setup: whose controllers are rolled out.
        timeout: longest duration of an episode, in s.
        words: open file for the traceback of one that hangs.

    Attributes:
        setup: whose controllers are rolled out.
    """

    def __init__(self, setup: Setup, timeout: float = TIMEOUT_SECONDS, words: Any = sys.__stderr__) -> None:
        self.setup = setup
        self._watchdog = _Watchdog(timeout, words)
        self._environment: Environment | None = None

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
            An episode for each; those whose code raised in a fresh environment too have failed, and say why.

        Raises:
            ValueError: x is no controller of the setup.
            OSError: the machine is in trouble; so does MemoryError.
        """
        with self._watchdog:
            return [self._attempt(unit_cube(x, self.setup.dimensions), physics) for x, physics in cases]

    def _attempt(self, x: np.ndarray, physics: Physics) -> Episode:
        was_fresh = self._environment is None
        try:
            return self._roll_out(x, physics)
        except _MACHINE_ERRORS:
            raise
        except (Exception, SystemExit) as error:  # noqa: BLE001 - users' code may raise anything
            self.close()
            failure = Failure(describe(error), full_traceback(error))
        # What an episode before left behind is not this one's fault.
        return failed_episode(self.setup, x, physics, failure) if was_fresh else self._attempt(x, physics)

    def _roll_out(self, x: np.ndarray, physics: Physics) -> Episode:
        self._watchdog.watch()
        if self._environment is None:
            self._environment = self.setup.open()
        return rollout(self.setup, self._environment, x, physics)

    def close(self) -> None:
        """End the simulation, if there is one."""
        environment, self._environment = self._environment, None
        if environment is not None:
            _close(environment)

    def __enter__(self) -> "Attempts":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _close(environment: Environment) -> None:
    with suppress(Exception):  # it has been given up already
        environment.close()


class _Watchdog:
    """Ends the process, with a traceback of its threads, when no episode has begun for too long.

    The standard library does it in C and needs no lock of Python's: code that hangs in C is ended too. It
    takes a millisecond to set, so that it is set anew only after a tenth of its time.
    """

    def __init__(self, seconds: float, words: Any) -> None:
        self._seconds = seconds
        self._words = words
        self._set = -math.inf

    def watch(self) -> None:
        """An episode begins."""
        now = time.monotonic()
        if now - self._set > self._seconds / 10:
            self._set = now
            faulthandler.dump_traceback_later(self._seconds * 1.1, exit=True, file=self._words)

    def __enter__(self) -> None:
        """Episodes follow."""

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """No episode is under way."""
        self._set = -math.inf
        faulthandler.cancel_dump_traceback_later()
