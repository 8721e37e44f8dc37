"""Runs as values: what a driver records while it works."""

import getpass
import json
import math
import os
import shlex
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any
from urllib.parse import urlsplit

from mlflow import MlflowClient
from mlflow.entities import Dataset, DatasetInput, InputTag, LifecycleStage, Metric, Param, RunTag
from mlflow.exceptions import MlflowException
from mlflow.protos.databricks_pb2 import RESOURCE_DOES_NOT_EXIST, ErrorCode
from sqlalchemy.exc import SQLAlchemyError

from cluster.config import SQLITE, TrackingSettings
from cluster.errors import UserError
from cluster.tracking.origin import origin
from svaedc.analysis.strict_json import json_values
from workers.dataset.storage.location import Location

UI_PORT = 5000
"""`svaedc ui` serves a SQLite store here unless told otherwise; a run's link points there."""
METRICS_PER_REQUEST = 1000
PARAMETERS_PER_REQUEST = 100
PARAMETER_LENGTH = 6000
TAG_LENGTH = 8000
DIGEST_LENGTH = 36
"""These five are MLflow's limits; a longer fingerprint is kept whole in the tag `svaedc.dataset`."""
STORE_ERRORS = (MlflowException, SQLAlchemyError, OSError, UnicodeError)
"""A store that fails raises one of these; the last where the system's encoding lacks a letter of its path."""


@dataclass(frozen=True)
class Run:
    """One run in the store; leaving its `with` block marks it FINISHED, FAILED or KILLED."""

    tracker: "Tracker"
    id: str

    @property
    def url(self) -> str:
        """Where a browser shows the run: on the server, or on `svaedc ui` of a SQLite store."""
        return f"{self.tracker.page}/{self.id}"

    @property
    def link(self) -> str:
        """The same for a person to read, with the command without which nothing answers there."""
        viewer = self.tracker.viewer
        return f"{self.url} (`{viewer}` shows it)" if viewer else self.url

    def metrics(self, values: Mapping[str, float], step: int) -> None:
        """Records numbers at one step, in one request; undefined ones (NaN, infinite) are left out.

        Args:
            values: numbers by name.
            step: of all of them.
        """
        self.curves({name: [value] for name, value in values.items()}, first_step=step)

    def curves(self, values: Mapping[str, Sequence[float]], first_step: int = 0) -> None:
        """Records whole curves in as few requests as can be; undefined values are left out.

        Args:
            values: curves by name, one value per step.
            first_step: of the first value of each.
        """
        now = int(time.time() * 1000)
        points = [
            Metric(name, float(value), now, first_step + offset)
            for name, curve in values.items()
            for offset, value in enumerate(curve)
            if math.isfinite(value)
        ]
        with self.tracker.reaching():
            for batch in _batches(points, METRICS_PER_REQUEST):
                self.tracker.client.log_batch(self.id, metrics=batch)

    def tags(self, values: Mapping[str, str]) -> None:
        """Sets tags, replacing earlier values."""
        with self.tracker.reaching():
            tags = [RunTag(key, _text(value)) for key, value in values.items()]
            self.tracker.client.log_batch(self.id, tags=tags)

    def figure(self, path: Path) -> None:
        """Keeps a copy of a figure that was written to a file, under `figures/`."""
        with self.tracker.reaching():
            self.tracker.client.log_artifact(self.id, str(path), "figures")

    def file(self, path: Path) -> None:
        """Keeps a copy of any small file, at the top of the run's artifacts."""
        with self.tracker.reaching():
            self.tracker.client.log_artifact(self.id, str(path))

    def dict(self, name: str, content: Mapping[str, Any]) -> None:
        """Keeps a summary as a JSON file.

        Args:
            name: of the file, without its suffix.
            content: plain values by name.
        """
        with self.tracker.reaching():
            self.tracker.client.log_dict(self.id, json_values({**content}), f"{name}.json")

    def dataset(self, name: str, fingerprint: str, path: Location) -> None:
        """Records a dataset as the run's input.

        Args:
            name: what MLflow lists it as.
            fingerprint: the dataset's hash; MLflow shows its first 36 characters as the digest.
            path: where the dataset lies.
        """
        uri = path.resolve().as_uri()
        kind = {"file": "local"}.get(urlsplit(uri).scheme, "s3")
        used = Dataset(name, fingerprint[:DIGEST_LENGTH], kind, json.dumps({"uri": uri}))
        with self.tracker.reaching():
            context = [InputTag("mlflow.data.context", "training")]
            self.tracker.client.log_inputs(self.id, [DatasetInput(used, context)])
        self.tags({"svaedc.dataset": fingerprint})

    def child(self, name: str, parameters: Mapping[str, Any]) -> "Run":
        """Starts a run that MLflow shows beneath this one.

        Args:
            name: shown in the list.
            parameters: settings of the run; nested mappings become dotted names.

        Returns:
            The new run.
        """
        return self.tracker.run(name, "child", parameters, {"mlflow.parentRunId": self.id})

    def __enter__(self) -> "Run":
        """Starts the block whose outcome becomes the run's."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Ends the run as its block ended; a store that fails meanwhile hides no error of the block."""
        try:
            with self.tracker.reaching():
                self.tracker.client.set_terminated(self.id, _ending(kind))
        except UserError as unreachable:
            if error is None:
                raise
            error.add_note(str(unreachable))


@dataclass(frozen=True)
class Tracker:
    """One experiment of one store."""

    client: MlflowClient
    uri: str
    experiment: str

    @property
    def page(self) -> str:
        """The experiment's list of runs; MLflow's front page would show another mode."""
        server = self.uri if self.uri.startswith("http") else f"http://127.0.0.1:{UI_PORT}"
        return f"{server.rstrip('/')}/#/experiments/{self.experiment}/runs"

    @property
    def viewer(self) -> str:
        """The command that serves the pages of a SQLite store; "" for a server, which is there already."""
        if not self.uri.startswith(SQLITE):
            return ""
        usual = Path(TrackingSettings().uri.removeprefix(SQLITE)).absolute()
        is_usual = self.uri == f"{SQLITE}{usual}"
        return "svaedc ui" if is_usual else f"svaedc ui --set {shlex.quote(f'tracking.uri={self.uri}')}"

    def run(
        self, name: str, kind: str, parameters: Mapping[str, Any], tags: Mapping[str, str] | None = None
    ) -> Run:
        """Starts a run.

        Args:
            name: shown in the list.
            kind: the command, as the tag `svaedc.kind`.
            parameters: settings of the run; nested mappings become dotted names.
            tags: further tags.

        Returns:
            The new run, which the end of its `with` block ends.

        Raises:
            UserError: the store cannot be written.
        """
        described = {"svaedc.kind": kind, "mlflow.user": _user(), **origin(kind), **(tags or {})}
        described = {key: _text(value)[:TAG_LENGTH] for key, value in described.items()}
        texts = [Param(key, _text(value)[:PARAMETER_LENGTH]) for key, value in _flat(parameters)]
        with self.reaching():
            run_id = self.client.create_run(self.experiment, tags=described, run_name=name).info.run_id
            for batch in _batches(texts, PARAMETERS_PER_REQUEST):
                self.client.log_batch(run_id, params=batch)
        return Run(self, run_id)

    def resume(self, run_id: str) -> Run:
        """Continues a run that ended or was interrupted; its parameters stay as they were.

        Raises:
            UserError: the store holds no such run, or cannot be written.
        """
        with self.reaching():
            self.client.update_run(run_id, status="RUNNING")
        return Run(self, run_id)

    def holds(self, run_id: str) -> bool:
        """Whether this experiment has the run, as another store, or one emptied since, does not.

        Raises:
            UserError: the store cannot be reached.
        """
        with self.reaching():
            try:
                found = self.client.get_run(run_id).info
            except MlflowException as error:
                if error.error_code == ErrorCode.Name(RESOURCE_DOES_NOT_EXIST):
                    return False
                raise
        return found.experiment_id == self.experiment and found.lifecycle_stage == LifecycleStage.ACTIVE

    @contextmanager
    def reaching(self) -> Iterator[None]:
        """Turns whatever a failing store raises into a `UserError` that names it."""
        try:
            yield
        except STORE_ERRORS as error:
            raise unusable(self.uri, error) from error


def unusable(uri: str, error: Exception) -> UserError:
    """The message for a store that failed, with the remedy.

    Args:
        uri: of the store.
        error: what it raised; its first line is told.

    Returns:
        The error, to be raised.
    """
    reason = str(error).strip().partition("\n")[0] or type(error).__name__
    remedy = "set LC_ALL=C.UTF-8" if isinstance(error, UnicodeError) else "make it writable and reachable"
    return UserError(
        f"the MLflow store {uri} cannot be used: {reason}; {remedy}, "
        "or name another with --set tracking.uri=sqlite:///FILE"
    )


def _text(value: object) -> str:
    """A value as MLflow keeps it: bytes of a file's name that the system's encoding lacks are UTF-8."""
    return str(value).encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def _user() -> str:
    """The user's name; containers often run as a number that has none."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return str(os.getuid())


def _ending(kind: type[BaseException] | None) -> str:
    """MLflow's word for how a block ended; what is no `Exception` (Ctrl-C, exit) came from outside."""
    if kind is None:
        return "FINISHED"
    return "FAILED" if issubclass(kind, Exception) else "KILLED"


def _flat(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Nested mappings as dotted names, in order."""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _batches(items: Sequence[Any], size: int) -> Iterator[Sequence[Any]]:
    """The items in order, at most `size` at a time."""
    for start in range(0, len(items), size):
        yield items[start : start + size]
