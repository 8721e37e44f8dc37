"""A connection to Ray: a cluster started here for one command, or a running one."""

import logging
import os
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import ray
from ray.exceptions import AuthenticationError, RaySystemError, RpcError

from cluster.config import Part, RaySettings
from cluster.errors import UsageError, UserError
from cluster.runtime import ray_internals
from cluster.runtime.shadows import require_no_shadows
from cluster.runtime.signals import terminating_as_exit
from cluster.runtime.sockets import require_short_paths

LOOPBACK = "127.0.0.1"
ATTEMPTS = 3
"""A cluster is started at most so many times on a machine that is too busy for it."""
TOO_SLOW = "timed out during startup"
"""Ray says this on such a machine."""
TOKEN_REMEDY = (
    "put the cluster's token into ~/.ray/auth_token, or name its file in RAY_AUTH_TOKEN_PATH, "
    "and set RAY_AUTH_MODE=token"
)


@dataclass(frozen=True)
class Session:
    """A cluster that is connected; `ray.*` works until the block that opened it ends."""

    address: str
    """The cluster's head has this host and port."""
    is_local: bool
    """It is true where this command started the cluster, which then ends with it."""
    cpus: int
    """So many CPUs of all its machines were free when it was joined; a submitted job may hold one itself."""
    gpus: int = 0
    """So many GPUs of all its machines were free when it was joined."""

    def preflight(self, cpus_required: int) -> None:
        """Refuses work that the cluster has no room for: Ray would wait for ever, in silence.

        Args:
            cpus_required: CPUs that must be free at the same time, Ray's own overhead included.

        Raises:
            UserError: fewer are free.
        """
        if cpus_required <= self.cpus:
            return
        needed = f"this needs {cpus_required} CPUs at the same time, the cluster at {self.address}"
        if self.is_local:
            remedy = f"ask for fewer workers, or use --set ray.num_cpus={cpus_required}"
            raise UserError(f"{needed} has {self.cpus}; {remedy}")
        raise UserError(
            f"{needed} has {self.cpus} free; ask for fewer workers, wait until other work there has ended, "
            "or use a larger cluster"
        )


@contextmanager
def connect(
    settings: RaySettings, address: str | None, parts: tuple[Part, ...] = ("dashboard",)
) -> Iterator[Session]:
    """Joins a running cluster, or starts one on this machine that listens on loopback only.

    Args:
        settings: how to start one, and how long a running one may take to answer.
        address: `host:port`, `auto` for the one running on this machine, or None: then the cluster of the
            environment's RAY_ADDRESS, which Ray sets inside a submitted job, or a new one.
        parts: of a new one; each costs CPU time for as long as the cluster lives.

    Yields:
        The connected cluster.

    Raises:
        UserError: the cluster is unreachable, refuses the token, or cannot be started; or a file in the
            working directory hides a library.
        UsageError: the address is malformed.
    """
    require_no_shadows(Path.cwd())
    wanted = address or os.environ.get("RAY_ADDRESS")
    if wanted:
        _join(settings, wanted)
    else:
        _start(settings, parts)
    try:
        with terminating_as_exit():
            yield _session(is_local=not wanted)
    finally:
        ray.shutdown()


def _session(*, is_local: bool) -> Session:
    """Describes the cluster that is connected now; all of one that was just started is free."""
    resources = ray.cluster_resources() if is_local else ray.available_resources()
    cpus, gpus = int(resources.get("CPU", 0)), int(resources.get("GPU", 0))
    return Session(ray.get_runtime_context().gcs_address, is_local, cpus, gpus)


def _start(settings: RaySettings, parts: tuple[Part, ...]) -> None:
    """Starts a cluster; a busy machine may need longer than the half minute that Ray grants itself."""
    require_short_paths(settings, parts)
    ray_internals.stay_on_loopback()
    ray_internals.lend_token()
    _bound_logs(settings.log_file_bytes)
    for further in reversed(range(ATTEMPTS)):
        try:
            _start_parts(settings, parts)
            break
        except Exception as error:  # Ray raises bare ones
            if further and TOO_SLOW in str(error):
                continue
            raise UserError(
                f"Ray cannot start here: {error}; its logs are in {settings.temporary_folder}, "
                "which --set ray.temporary_folder=DIR moves"
            ) from error


def _start_parts(settings: RaySettings, parts: tuple[Part, ...]) -> None:
    """Starts a cluster with these parts only."""
    if "dashboard" in parts:
        chosen = ray_internals.settings(ray_internals.PRIORITY)
        _initialize(settings, include_dashboard=True, _system_config=chosen)
        return
    with ray_internals.quiet_agent():
        chosen = ray_internals.settings(ray_internals.PRIORITY, ray_internals.UNWATCHED)
        _initialize(settings, include_dashboard=False, _system_config=chosen)
    ray_internals.end_spectators()


def _initialize(settings: RaySettings, **more: Any) -> None:
    """Starts Ray with the arguments that all clusters share, and those given."""
    ray.init(
        address="local",
        num_cpus=None if settings.num_cpus == "all" else settings.num_cpus,
        resources={"hardware": 1},
        object_store_memory=settings.object_store_memory,
        dashboard_host=LOOPBACK,
        log_to_driver=False,
        logging_level=logging.ERROR,
        _temp_dir=str(settings.temporary_folder),
        **more,
    )


def _join(settings: RaySettings, wanted: str) -> None:
    """Joins a running cluster after quick tries of its port and of its token."""
    address = _on_this_machine(settings) if wanted == "auto" else wanted
    _knock(address, settings.connect_timeout_seconds)
    try:
        if LOOPBACK in _authenticate(address, settings.connect_timeout_seconds):
            ray_internals.stay_on_loopback()
        ray.init(address=address, log_to_driver=False, logging_level=logging.ERROR)
    except AuthenticationError as error:
        raise UserError(f"the Ray cluster at {address} refuses this user's token: {TOKEN_REMEDY}") from error
    except (RpcError, ConnectionError, RuntimeError, RaySystemError) as error:
        reason = str(error).partition("\n")[0]
        raise UserError(
            f"the Ray cluster at {address} cannot be joined: {reason}; this machine must be part of it (from "
            f"any other, use `ray job submit`), and it must run Ray {ray.__version__} and Python "
            f"{sys.version_info.major}.{sys.version_info.minor}"
        ) from error


def _knock(address: str, patience: float) -> None:
    """Tries the cluster's port; Ray itself would try for minutes."""
    try:
        socket.create_connection(_parts(address), timeout=patience).close()
    except OSError as error:
        raise UserError(
            f"no Ray cluster answers at {address}: {error}; check the address and that `ray start --head` "
            "runs there, or leave --address and RAY_ADDRESS out to use this machine alone"
        ) from error


def _on_this_machine(settings: RaySettings) -> str:
    """The address that the last cluster started on this machine left behind."""
    address = ray_internals.address_on_this_machine(str(settings.temporary_folder))
    if not address:
        raise UserError(
            f"no Ray cluster was started on this machine (none is named in {settings.temporary_folder}): "
            "start one with `ray start --head`, or leave --address out"
        )
    return address


def _parts(address: str) -> tuple[str, int]:
    """Host and port of an address as Ray takes it."""
    host, colon, port = address.rpartition(":")
    if not (colon and host and port.isdigit()) or "/" in address:
        raise UsageError(f"a Ray address is host:port or auto, such as 192.168.1.10:6379, got {address!r}")
    return host.strip("[]"), int(port)


def _authenticate(address: str, patience: float) -> set[str]:
    """Network addresses of the cluster's machines, from which on a token is used if the cluster wants one.

    One that wants none must not be shown any: this process would then demand it of the cluster, which takes
    its silence for death, and ends all that it starts.
    """
    try:
        return _machines(address, patience)
    except AuthenticationError:
        ray_internals.use_token()
        return _machines(address, patience)


def _machines(address: str, patience: float) -> set[str]:
    """Network addresses of the cluster's machines, waiting for the first to register."""
    deadline = time.monotonic() + patience
    while True:
        found = ray_internals.node_addresses(address, patience)
        if found or time.monotonic() > deadline:
            return found
        time.sleep(0.2)


def _bound_logs(size: int) -> None:
    """Two files of that many bytes per stream of a process; otherwise Ray lets a worker's output grow."""
    os.environ["RAY_ROTATION_MAX_BYTES"] = str(size)
    os.environ["RAY_ROTATION_BACKUP_COUNT"] = "1"
