"""What long work needs beside its settings: the tracker, and a connection to Ray."""

from collections.abc import Iterator
from contextlib import contextmanager

from cluster.config import Part, Settings
from cluster.inputs import durable
from cluster.runtime.session import Session, connect
from cluster.tracking import Tracker, open_tracker


@contextmanager
def services(
    settings: Settings, address: str | None, parts: tuple[Part, ...] = ("dashboard",)
) -> Iterator[tuple[Session, Tracker]]:
    """Opens both, and ends what it started.

    Args:
        settings: of the sections `ray` and `tracking`.
        address: of a running cluster, as `connect` takes it; None to start one here.
        parts: of a cluster that is started here.

    Yields:
        The connection to Ray, and the tracker, whose store must exist before anything else starts.

    Raises:
        UsageError: the store would be deleted with a job's copy of the working directory.
        UserError: the store or the cluster cannot be used.
    """
    durable(settings.tracking.file)
    tracker = open_tracker(settings.tracking)
    with connect(settings.ray, address, parts) as session:
        yield session, tracker
