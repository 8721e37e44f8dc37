"""What becomes of records while the store is away: one policy for all drivers.

A store that fails while a command works ends nothing: the first failure is said, what it missed is kept in
its order, and the store is left alone for a pause that doubles with every failure, because one request to a
dead server lasts minutes. What is still missing when the work is done is the driver's to record, and an error
then.
"""

import math
import time
from collections import deque
from collections.abc import Callable

from cluster.errors import UserError
from cluster.progress import say

PAUSE_SECONDS = 30.0
"""The pause after the store's first failure is twice as long."""


class Recorder:
    """Records what it is given, now or when the store is back.

    Args:
        consequence: what a person reads behind the store's first failure.
        pause: seconds; every failure of the store doubles them, and it is left alone for that long.
    """

    def __init__(self, consequence: str, pause: float = PAUSE_SECONDS) -> None:
        self._consequence, self._pause = consequence, pause
        self._waiting: deque[Callable[[], object]] = deque()
        self._due = -math.inf
        self._has_failed = False

    def record(self, action: Callable[[], object]) -> None:
        """Do it, after all that is waiting; keep it if the store fails, or failed a moment ago.

        Args:
            action: raises `UserError` where the store fails; it may be done again after that.
        """
        self._waiting.append(action)
        if time.monotonic() < self._due:
            return
        try:
            self.complete()
        except UserError as error:
            if not self._has_failed:
                say(f"{error}{self._consequence}")
            self._has_failed = True
            self._pause *= 2
            self._due = time.monotonic() + self._pause

    def complete(self) -> None:
        """Do all that is waiting, in its order.

        Raises:
            UserError: the store still fails.
        """
        while self._waiting:
            self._waiting[0]()
            self._waiting.popleft()

    def give_up(self) -> None:
        """Leave a store that has failed alone from now on: who has pressed Ctrl-C does not wait for it."""
        if self._has_failed:
            self._due = math.inf
