"""Messages from Ray workers to the driver, in order, while the driver waits for something else."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from ray.exceptions import RayError
from ray.util.queue import Queue

_POLL_SECONDS = 0.5
_FAREWELL_SECONDS = 5.0
"""An interrupted block waits so long for what `receive` is doing."""


@contextmanager
def mailbox(receive: Callable[[Any], None]) -> Iterator[Queue]:
    """A mailbox whose messages are handed to `receive`, on a thread of the driver, until the block ends.

    An error in `receive` keeps no later message from it; the first is raised at the end of the block. A block
    that ends by Ctrl-C or an exit does not wait for a `receive` that takes long, nor for what it left over.
    """
    box = Queue(actor_options={"num_cpus": 0})
    ended = threading.Event()
    errors: list[Exception] = []

    def deliver() -> None:
        while not ended.wait(_POLL_SECONDS):
            _take(box, receive, errors)

    thread = threading.Thread(target=deliver, daemon=True)
    thread.start()
    patience = None
    try:
        yield box
    except (KeyboardInterrupt, SystemExit):
        patience = _FAREWELL_SECONDS
        raise
    finally:
        ended.set()
        thread.join(patience)
        if not thread.is_alive():
            _take(box, receive, errors)
        box.shutdown(force=True)
    if errors:
        raise errors[0]


def _take(box: Queue, receive: Callable[[Any], None], errors: list[Exception]) -> None:
    try:
        messages = box.get_nowait_batch(box.qsize())
    except RayError as error:
        errors.append(error)
        return
    for message in messages:
        try:
            receive(message)
        except Exception as error:  # noqa: BLE001 - crosses a thread; raised where the block ends
            errors.append(error)
