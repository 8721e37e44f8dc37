"""SIGTERM and Ctrl-C leave a block as exits of their own codes."""

import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from cluster.runtime.signals import terminating_as_exit


@contextmanager
def exits_losing_their_code() -> Iterator[None]:
    """As `ray.get` does."""
    try:
        yield
    except SystemExit:
        raise SystemExit(1) from None


def test_sigterm_leaves_with_its_code_even_where_that_was_lost_on_the_way():
    before = signal.getsignal(signal.SIGTERM)
    with pytest.raises(SystemExit) as left, terminating_as_exit(), exits_losing_their_code():
        os.kill(os.getpid(), signal.SIGTERM)
    assert left.value.code == 143
    assert signal.getsignal(signal.SIGTERM) == before


def test_an_exit_of_another_cause_keeps_its_code():
    with pytest.raises(SystemExit) as left, terminating_as_exit():
        raise SystemExit(3)
    assert left.value.code == 3
