"""What a long command needs beside its settings: the tracker, and a connection to Ray."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from cluster.config import Part, Settings
from cluster.options import durable, interruptible

if TYPE_CHECKING:
    from cluster.session import Session
    from cluster.tracking import Tracker


@contextmanager
def services(
    settings: Settings, address: str | None, parts: tuple[Part, ...] = ("dashboard",)
) -> Iterator[tuple["Session", "Tracker"]]:
    """The tracker, whose store must exist before anything else starts, and the Ray session."""
    from cluster.session import connect
    from cluster.tracking import open_tracker

    store = settings.tracking.uri.removeprefix("sqlite:///")
    if store != settings.tracking.uri:
        durable(Path(store))
    tracker = open_tracker(settings.tracking)
    with interruptible(), connect(settings.ray, address, parts) as session:
        yield session, tracker
