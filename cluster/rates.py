"""How fast each machine is just now."""

import time
from collections import deque
from dataclasses import dataclass, field

WINDOW_SECONDS = 600.0
LISTED = 4
"""Machines that are named one by one; of more, the slowest and the fastest are."""


@dataclass
class Rates:
    """Episodes per second of every machine over the last minutes; one that fell silent is seen to be at 0.

    Attributes:
        window: of the last so many seconds.
        begin: when the work began, by the monotonic clock.
    """

    window: float = WINDOW_SECONDS
    begin: float = field(default_factory=time.monotonic)
    _finished: deque[tuple[float, str, int]] = field(default_factory=deque)
    _episodes: dict[str, int] = field(default_factory=dict)

    def add(self, machine: str, episodes: int) -> None:
        """Count episodes that a machine has just finished."""
        self._finished.append((time.monotonic(), machine, episodes))
        self._episodes[machine] = self._episodes.get(machine, 0) + episodes

    def now(self) -> dict[str, float]:
        """Episodes per second by machine, in the order of their names."""
        moment = time.monotonic()
        while self._finished and self._finished[0][0] < moment - self.window:
            _, machine, episodes = self._finished.popleft()
            self._episodes[machine] -= episodes
        seconds = max(min(moment - self.begin, self.window), 1e-9)
        return {machine: self._episodes[machine] / seconds for machine in sorted(self._episodes)}

    def note(self) -> str:
        """The machines' rates for a line of progress; nothing for one machine, whose rate is the total."""
        rates = self.now()
        if len(rates) < 2:
            return ""
        if len(rates) <= LISTED:
            return "".join(f", {machine} {rate:.1f}/s" for machine, rate in rates.items())
        slow, fast = min(rates, key=rates.__getitem__), max(rates, key=rates.__getitem__)
        return f", {len(rates)} machines from {slow} {rates[slow]:.1f}/s to {fast} {rates[fast]:.1f}/s"
