"""Browsers that are logged in: a random name in a cookie, and another in every form."""

import hmac
import secrets
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Final

from cluster.console.access import Person

COOKIE: Final = "svaedc"
LIFETIME_SECONDS: Final = 12 * 3600.0
_MOST: Final = 1_000
_TRIES: Final = 10
_TRIES_SECONDS: Final = 60.0


@dataclass(frozen=True)
class BrowserSession:
    """One browser that somebody entered with.

    Attributes:
        person: who entered.
        key: stands in every form of its pages; other sites do not know it.
        until: moment of its end, in s of `time.monotonic`.
    """

    person: Person
    key: str
    until: float

    def holds(self, key: str) -> bool:
        """Whether a form came from one of this browser's own pages."""
        return hmac.compare_digest(self.key.encode(), key.encode("utf-8", "surrogateescape"))


@dataclass
class Sessions:
    """All of them; they end with the process, and people enter again.

    Attributes:
        failures: moments of tokens that were wrong, the latest ones.
    """

    failures: deque[float] = field(default_factory=lambda: deque(maxlen=_TRIES))
    _known: dict[str, BrowserSession] = field(default_factory=dict)

    def begin(self, person: Person) -> str:
        """Let a browser in; returns the value of its cookie."""
        now = time.monotonic()
        self._known = {name: each for name, each in self._known.items() if each.until > now}
        while len(self._known) >= _MOST:
            self._known.pop(next(iter(self._known)))
        name = secrets.token_urlsafe(24)
        self._known[name] = BrowserSession(person, secrets.token_urlsafe(24), now + LIFETIME_SECONDS)
        return name

    def find(self, cookie: str) -> BrowserSession | None:
        """The session of a cookie; None where there is none, or where it is over."""
        found = self._known.get(cookie)
        return found if found and found.until > time.monotonic() else None

    def end(self, cookie: str) -> None:
        """Let a browser in no more."""
        self._known.pop(cookie, None)

    @property
    def is_guessed_at(self) -> bool:
        """Whether so many tokens were wrong lately that no more are looked at for a while."""
        return len(self.failures) == _TRIES and time.monotonic() - self.failures[0] < _TRIES_SECONDS

    def note_failure(self) -> None:
        """A token was wrong."""
        self.failures.append(time.monotonic())
