"""The store behind the runs: a SQLite file, created safely, or an MLflow server."""

import logging
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import SplitResult, urlsplit

from mlflow import MlflowClient
from mlflow.entities import LifecycleStage
from mlflow.exceptions import MlflowException
from sqlalchemy import URL

from cluster.config import SQLITE, TrackingSettings
from cluster.errors import UserError
from cluster.files import replacing, turn_in
from cluster.tracking.runs import STORE_ERRORS, Tracker, unusable

ARTIFACT_ROOT = "_MLFLOW_SERVER_ARTIFACT_ROOT"
"""MLflow's processes tell each other by this variable where experiments without a place of their own lie."""
CONNECT_SECONDS = 5.0
"""A server that accepts no connection within this is unreachable; MLflow itself would retry for minutes."""


def open_tracker(settings: TrackingSettings) -> Tracker:
    """Opens the store, creating its folder, tables and experiment where they are absent.

    Call it before anything else starts: processes that create the same SQLite tables at once break them, and
    only among commands of one machine does the lock on the folder prevent that.

    Raises:
        UserError: the store cannot be created, reached or written.
    """
    logging.getLogger("mlflow").setLevel(logging.WARNING)
    logging.getLogger("alembic").setLevel(logging.WARNING)
    uri = settings.uri
    try:
        if settings.file is None:
            _knock(urlsplit(uri))
            client = MlflowClient(uri)
            return Tracker(client, uri, _experiment(client, settings.experiment, artifacts=None))
        database = settings.file.absolute()
        uri = f"{SQLITE}{database}"
        with turn_in(database.parent):
            artifacts = (database.parent / "mlruns").as_uri()
            if not database.exists():
                _create(database, settings.experiment, artifacts)
            client = MlflowClient(_address(database))
            return Tracker(client, uri, _experiment(client, settings.experiment, artifacts))
    except STORE_ERRORS as error:
        raise unusable(uri, error) from error


def _address(database: Path) -> str:
    """What SQLAlchemy reads as this file, whatever its path holds.

    The driver is named because MLflow takes what follows a bare `sqlite:///` for a path and makes its folder.

    Raises:
        UnicodeError: the path is not text in the system's encoding, and MLflow could not find it again.
    """
    return URL.create("sqlite+pysqlite", database=str(database)).render_as_string(hide_password=False)


def _create(database: Path, experiment: str, artifacts: str) -> None:
    """Makes the tables elsewhere first: MLflow refuses for ever a database whose making was cut short."""
    with replacing(database) as unfinished, _first_experiment_in(artifacts):
        unfinished.unlink(missing_ok=True)
        _experiment(MlflowClient(_address(unfinished)), experiment, artifacts)


@contextmanager
def _first_experiment_in(artifacts: str) -> Iterator[None]:
    """Lets MLflow's own first experiment lie in a place that is a URI.

    It would be the working directory, whose name MLflow puts between quotes into a statement of SQL.
    """
    before = os.environ.get(ARTIFACT_ROOT)
    os.environ[ARTIFACT_ROOT] = artifacts
    try:
        yield
    finally:
        del os.environ[ARTIFACT_ROOT]
        if before is not None:
            os.environ[ARTIFACT_ROOT] = before


def _experiment(client: MlflowClient, name: str, artifacts: str | None) -> str:
    """The experiment's id; another command may create it between our look and our try."""
    found = client.get_experiment_by_name(name)
    if found is None:
        try:
            return str(client.create_experiment(name, artifact_location=artifacts))
        except MlflowException as error:
            found = client.get_experiment_by_name(name)
            if found is None:
                raise error
    if found.lifecycle_stage == LifecycleStage.DELETED:
        raise UserError(
            f"the MLflow experiment {name!r} was deleted; restore it or --set tracking.experiment=NAME"
        )
    return str(found.experiment_id)


def _knock(address: SplitResult) -> None:
    """Tries one connection to a tracking server; other kinds of store report for themselves."""
    if address.scheme in {"http", "https"}:
        port = address.port or {"http": 80, "https": 443}[address.scheme]
        socket.create_connection((address.hostname or "", port), timeout=CONNECT_SECONDS).close()
