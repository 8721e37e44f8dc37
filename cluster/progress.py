"""Progress of long work: counts, rate and time left, on a terminal or in a log."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Column

_LOG_SECONDS = 10.0
_BAR_WIDTH = 20
_WIDE = 80
"""A terminal of fewer columns has no room for the bar beside the numbers."""


class ProgressLine:
    """One line that says how far the work is; in a log, one line every ten seconds and one at the end.

    Args:
        what: is counted, such as "episodes".
        total: how many there are.
        done: how many were there before.
    """

    def __init__(self, what: str, total: int, done: int) -> None:
        self._what = what
        self._total = total
        self._before = done
        self.done = done
        self._note = ""
        self._begin = time.monotonic()
        self._logged = self._begin
        self._bar = _bar(what) if sys.stderr.isatty() else None
        self._task = self._bar.add_task(what, total=total, completed=done, note="") if self._bar else None

    def __enter__(self) -> "ProgressLine":
        if self._bar:
            self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar:
            self._bar.stop()
        elif kind is None and self.done > self._before:
            self._log(f"in {duration(time.monotonic() - self._begin)}")

    @property
    def rate(self) -> float:
        """Items per second since the start."""
        return (self.done - self._before) / max(time.monotonic() - self._begin, 1e-9)

    def advance(self, count: int, note: str) -> None:
        """Count items as done.

        Args:
            count: how many.
            note: shown behind the rate; "" for nothing.
        """
        self.done += count
        self._total = max(self._total, self.done)  # some work is found on the way
        self._note = note
        if self._bar and self._task is not None:
            self._bar.update(
                self._task, advance=count, total=self._total, note=f"{_per_second(self.rate)}  {note}"
            )
        elif time.monotonic() - self._logged > _LOG_SECONDS:
            self._logged = time.monotonic()
            self._log(f"{self._time_left()} left")

    def _log(self, when: str) -> None:
        """One line, which ends with its last word whatever there is to say."""
        share = f" ({100 * self.done // self._total} %)" if self._total else ""
        counts = f"{self.done}/{self._total} {self._what}{share}"
        say(", ".join(filter(None, (counts, _per_second(self.rate), when, self._note))))

    def _time_left(self) -> str:
        if self.done == self._before:
            return "unknown time"
        return duration((self._total - self.done) / self.rate)


def _bar(what: str) -> Progress:
    """On a narrow terminal the note is folded, and nothing else is: numbers stay whole."""
    console = Console(stderr=True)
    return Progress(
        TextColumn(what),
        *([BarColumn(_BAR_WIDTH)] if console.width >= _WIDE else []),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[note]}", table_column=Column(overflow="fold")),
        console=console,
        refresh_per_second=2,
    )


def _per_second(rate: float) -> str:
    """A rate with a digit behind the point, or the first two that matter."""
    return f"{rate:.1f}/s" if rate >= 1 else f"{rate:.2g}/s"


@contextmanager
def timing(what: str) -> Iterator[None]:
    """Say what begins, and how long it took."""
    begin = time.monotonic()
    say(f"{what} ...")
    yield
    say(f"{what}: {duration(time.monotonic() - begin)}")


def say(text: str) -> None:
    """One line for the person who watches; work goes on when nobody does, as after `2>&1 | head`."""
    with suppress(OSError):
        print(text, file=sys.stderr, flush=True)


def duration(seconds: float) -> str:
    """A duration in the largest two units that matter: 2 h 05 min, 3 min 20 s, 12 s."""
    whole = round(seconds)
    if whole >= 3600:
        return f"{whole // 3600} h {whole % 3600 // 60:02d} min"
    return f"{whole // 60} min {whole % 60:02d} s" if whole >= 60 else f"{whole} s"
