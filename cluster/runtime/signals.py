"""SIGTERM and Ctrl-C as ordinary ways to end: what was begun is cleaned up."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

from cluster.errors import ExitCode
from cluster.progress import say


@contextmanager
def terminating_as_exit() -> Iterator[None]:
    """Lets SIGTERM (`ray job stop`, a service manager) and Ctrl-C unwind the stack inside the block.

    Enter it after `ray.init`, which replaces the handlers set before it. In a thread, which may not set
    handlers, it does nothing.

    SIGTERM leaves the block as an exit with code 143, whatever came of it inside: an exit of any code comes
    out of `ray.get` with code 1, and out of a training as Ctrl-C.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    terminated = threading.Event()

    def leave(_number: int, _frame: FrameType | None) -> None:
        terminated.set()
        raise SystemExit(ExitCode.TERMINATED)

    # A compiled library may have put a handler of its own beneath Python's, which then never runs: MLflow
    # imports Polars where it is installed, and that swallows Ctrl-C. Setting Python's again takes it back.
    signal.signal(signal.SIGINT, signal.getsignal(signal.SIGINT) or signal.default_int_handler)
    previous = signal.signal(signal.SIGTERM, leave)
    try:
        yield
    except (KeyboardInterrupt, SystemExit):
        if terminated.is_set():
            raise SystemExit(ExitCode.TERMINATED) from None
        raise
    finally:
        signal.signal(signal.SIGTERM, previous)


KEPT = "everything finished is kept, and the same command goes on from here"
"""Stopping means this for nearly all commands."""


@contextmanager
def interruptible(consequence: str = KEPT) -> Iterator[None]:
    """Ends a long command that was asked to stop with one sentence and the usual exit code.

    Args:
        consequence: what that means, the rest of the sentence.
    """
    try:
        yield
    except (KeyboardInterrupt, SystemExit) as stop:
        say(f"stopped: {consequence}")
        raise SystemExit(stop.code if isinstance(stop, SystemExit) else ExitCode.INTERRUPTED) from None
