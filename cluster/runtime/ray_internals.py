"""What is needed of Ray that it does not publish; no other module imports its private ones.

Ray's processes cost CPU time for as long as they live. `settings`, `quiet_agent` and `end_spectators` are
what a cluster without the dashboard does without. All of it is there to be looked at in the dashboard, or to
print at this terminal what workers print, which no command asks for. Workers that die are noticed, and memory
is watched over, by the raylet and the head alone. `docs/results/benchmarks.md` says what each entry saves.
"""

import os
import secrets
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ray
from ray._private import ray_constants, services, state, worker
from ray._raylet import AuthenticationTokenLoader, Config, GcsClient  # type: ignore[attr-defined]
from ray.experimental import internal_kv

from cluster.home import is_writable

PRIORITY: Mapping[str, Any] = {
    # Ray starts workers at niceness 15: beside other work on every core they get a thirtieth of their share.
    "worker_niceness": 0,
}
"""Every cluster that is started here has it."""

UNWATCHED: Mapping[str, Any] = {
    # Counters that every process exports every ten seconds, for the dashboard and Prometheus.
    "enable_metrics_collection": False,
}
"""Clusters without a dashboard have these as well."""

AGENT: Mapping[str, str] = {
    # The agent, without which no raylet lives, looks at every process so often; by default every 5 s.
    "REPORTER_UPDATE_INTERVAL_MS": "3600000",
}
"""The agent has these, and knows them by its environment only."""


def settings(*wanted: Mapping[str, Any]) -> dict[str, Any]:
    """Settings of all of Ray's processes, but for those that the user has chosen.

    Args:
        wanted: the settings, by their names in Ray.

    Returns:
        Those for which there is no RAY_<name> in the environment.
    """
    each = {name: value for settings in wanted for name, value in settings.items()}
    return {name: value for name, value in each.items() if f"RAY_{name}" not in os.environ}


@contextmanager
def quiet_agent() -> Iterator[None]:
    """Let the agent that is started within this block inherit its settings; later clusters do not."""
    ours = {name: value for name, value in AGENT.items() if name not in os.environ}
    os.environ.update(ours)
    try:
        yield
    finally:
        for name in ours:
            os.environ.pop(name, None)


def end_spectators() -> None:
    """End the processes of the cluster just started that only watch; `ray.init` starts them regardless.

    They are the log monitor, which searches the workers' logs ten times a second for a driver that prints
    them, and what remains of the dashboard, which reports its own load. The logs are written without them.
    """
    node = worker._global_node
    if node is not None:
        node.kill_log_monitor(check_alive=False)
        node.kill_dashboard(check_alive=False)


def actor_facts(actor: Any) -> Mapping[str, Any]:
    """What Ray's head knows of an actor, by the names of its protocol; nothing of one that is lost.

    Args:
        actor: its handle.

    Returns:
        `State`, `Address` and more.
    """
    return state.actors(actor._actor_id.hex()) or {}


def claim_name(name: str) -> Mapping[str, Any]:
    """Have a name in the connected cluster for this driver, as long as it lives.

    Args:
        name: that one driver at a time may have.

    Returns:
        Nothing where it is this driver's now; else what the head knows of the one that has it: `DriverPid`,
        `DriverIPAddress` and more.
    """
    own, key = ray.get_runtime_context().get_job_id().encode(), name.encode()
    if not internal_kv._internal_kv_put(key, own, overwrite=False):
        return {}
    holder = internal_kv._internal_kv_get(key) or b""
    alive = [job for job in state.jobs() if job["JobID"].encode() == holder and not job["IsDead"]]
    if alive and holder != own:
        return alive[0]
    internal_kv._internal_kv_put(key, own, overwrite=True)
    return {}


def give_up_name(name: str) -> None:
    """Let another driver have a name, if it is this one's."""
    own, key = ray.get_runtime_context().get_job_id().encode(), name.encode()
    if internal_kv._internal_kv_get(key) == own:
        internal_kv._internal_kv_del(key)


def free_resources() -> list[Mapping[str, float]]:
    """What each machine of the connected cluster has free, by the names of Ray's resources."""
    return list(state.available_resources_per_node().values())


def address_on_this_machine(temporary_folder: str) -> str:
    """Address of the last cluster started on this machine with its files in that folder; "" for none."""
    return str(services.find_bootstrap_address(temporary_folder) or "")


def node_addresses(address: str, patience: float) -> set[str]:
    """Network addresses of the machines of a cluster that is not joined yet.

    Unlike `ray.init`, it reports a refused token at once.

    Args:
        address: host and port of its head.
        patience: s, for the answer.

    Returns:
        One for each machine; none while the first has not registered.

    Raises:
        AuthenticationError: the cluster refuses this process's token.
        RpcError: it does not answer.
    """
    nodes = GcsClient(address=address).get_all_node_info(timeout=patience)
    return {node.node_manager_address for node in nodes.values()}


def use_token() -> None:
    """Shows a token to the cluster if this user has one; Ray does so for clusters of its own only."""
    loader = AuthenticationTokenLoader.instance()
    if "RAY_AUTH_MODE" not in os.environ and loader.has_token(ignore_auth_mode=True):
        os.environ["RAY_AUTH_MODE"] = "token"
        Config.initialize("")


def lend_token() -> None:
    """Gives a cluster that ends with this process a token in memory if the home takes none, as Ray would."""
    loader = AuthenticationTokenLoader.instance()
    if not loader.has_token(ignore_auth_mode=True) and not is_writable(Path.home() / ".ray"):
        os.environ["RAY_AUTH_TOKEN"] = secrets.token_hex(32)


def stay_on_loopback() -> None:
    """Makes Ray use 127.0.0.1 where it would look for an address that other machines can reach.

    Ray reads the variable when it is imported, so the constant is set too; its processes inherit the former.
    """
    os.environ[ray_constants.ENABLE_RAY_CLUSTERS_ENV_VAR] = "0"
    ray_constants.ENABLE_RAY_CLUSTER = False


def health_check_failure(error: Exception) -> object:
    """What Ray Train's check of a training process failed of; None for every other error."""
    from ray.train.v2._internal.exceptions import WorkerHealthCheckFailedError

    return error.health_check_failure if isinstance(error, WorkerHealthCheckFailedError) else None


def is_train_error(error: Exception) -> bool:
    """Whether Ray Train itself raised it, and not the code that it runs."""
    from ray.train.v2._internal.exceptions import RayTrainError

    return isinstance(error, RayTrainError)
