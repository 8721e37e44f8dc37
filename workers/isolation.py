"""Episodes in a process of their own: one that hangs or ends its process costs itself and nothing else."""

import faulthandler
import os
import threading
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from dataclasses import replace
from multiprocessing import get_context, parent_process
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from workers.attempts import TIMEOUT_SECONDS, Attempts, SafeRollouts
from workers.episode import Episode, Failure
from workers.physics import Physics
from workers.setups import Setup, load
from workers.setups.declared import changes, declaration, list_changes
from workers.setups.user_bad import with_bad


class IsolatedAttempts(SafeRollouts):
    """Rolls out in a child process: an episode that hangs or ends its process fails, the next gets a new one.

    Args:
        setup: whose controllers are rolled out; the child loads it by its name.
        timeout: longest duration of an episode, in s.

    Raises:
        ValueError: the setup is not the one of its name, which the child would roll out instead.
    """

    def __init__(self, setup: Setup, timeout: float = TIMEOUT_SECONDS) -> None:
        super().__init__(setup)
        _require_as_named(setup)
        self._timeout = timeout
        self._folder = TemporaryDirectory(prefix="svaedc-")
        self._child: ProcessPoolExecutor | None = None

    @property
    def _is_fresh(self) -> bool:
        return self._child is None

    def _try(self, x: np.ndarray, physics: Physics) -> Episode | Failure:
        try:
            return self._executor().submit(_roll_out, x, dict(physics)).result()
        except BrokenProcessPool:
            self._child = None
            return self._failure()

    def _executor(self) -> ProcessPoolExecutor:
        if self._child is None:
            self._last.unlink(missing_ok=True)
            self._child = ProcessPoolExecutor(
                max_workers=1,
                mp_context=get_context("spawn"),
                initializer=_begin,
                initargs=(self.setup.name, self.setup.task.bad_name, self._timeout, self._last),
            )
        return self._child

    @property
    def _last(self) -> Path:
        return Path(self._folder.name) / "last_words.txt"

    def _failure(self) -> Failure:
        """What the child wrote when it died; nothing if it was killed, or left by `os._exit`."""
        words = self._last.read_text(encoding="utf-8", errors="replace") if self._last.exists() else ""
        if words.startswith("Timeout"):
            rolling_out = words.rpartition("\n\n")[2]  # the main thread comes last
            return Failure(f"it took longer than {self._timeout:g} s", rolling_out)
        told = words.partition("\n")[0].strip() or "killed from outside, or by its own exit, without a word"
        return Failure(f"it ended its process: {told}", words.partition("\nExtension modules")[0] or told)

    def close(self) -> None:
        """End the child."""
        if self._child is not None:
            self._child.shutdown()
        self._child = None
        self._folder.cleanup()


def _require_as_named(setup: Setup) -> None:
    # Physics are given to every episode, whatever range they were drawn from.
    loaded = replace(with_bad(load(setup.name), setup.task.bad_name), physics=setup.physics)
    own, named = declaration(setup), declaration(loaded)
    if own != named:
        raise ValueError(
            f"a child process loads {setup.name!r} by its name, which must give the same setup; they differ "
            f"in {list_changes(changes(own, named))}: write it into a module of its own"
        )


_attempts: Attempts
"""In a child, this rolls out."""
_words: Any
"""In a child, this file takes its last words; it stays open, for a crash cannot open one."""


def _begin(setup: str, bad: str, timeout: float, last_words: Path) -> None:
    global _attempts, _words
    _words = last_words.open("w", encoding="utf-8")
    faulthandler.enable(file=_words, all_threads=False)
    _attempts = Attempts(with_bad(load(setup), bad), timeout, _words)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """A parent that was killed has told nobody to end."""
    parent = parent_process()
    if parent is not None:
        parent.join()
    os._exit(1)


def _roll_out(x: np.ndarray, physics: Physics) -> Episode:
    return _attempts.rollout(x, physics)
