"""Machines of the connected cluster: whether one is still there, what all have free, and who has a place."""

import socket
from typing import Any

import ray
from ray.exceptions import RpcError

from cluster.runtime.ray_internals import actor_facts

KNOCK_SECONDS = 2.0
"""A machine has so long to answer; Ray itself takes a quarter of a minute to miss one."""


def own_machine() -> str:
    """The id of the machine whose Ray processes this driver uses."""
    return str(ray.get_runtime_context().get_node_id())


def machine_of(actor: Any) -> str:
    """The id of the machine on which an actor runs; "" if the actor is lost already."""
    return str(actor_facts(actor).get("Address", {}).get("NodeID", ""))


def has_a_place(actor: Any) -> bool:
    """Whether an actor runs on some machine; otherwise it waits for what it requires, or is lost."""
    return actor_facts(actor).get("State") == "ALIVE"


def is_there(machine: str) -> bool:
    """Whether a machine still belongs to the cluster: Ray lists it as alive, and its raylet answers."""
    try:
        nodes = ray.nodes()
    except RpcError:  # the head is gone, and the cluster with it
        return False
    for node in nodes:
        if node["NodeID"] == machine and node["Alive"]:
            return _answers(node["NodeManagerAddress"], node["NodeManagerPort"])
    return False


def free_cpus() -> int:
    """CPUs of all machines that nothing occupies just now."""
    return int(ray.available_resources().get("CPU", 0))


def _answers(host: str, port: int) -> bool:
    try:
        socket.create_connection((host, port), timeout=KNOCK_SECONDS).close()
    except OSError:
        return False
    return True
