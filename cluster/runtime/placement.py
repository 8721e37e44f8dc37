"""Where processes fit: each needs all its CPUs, and its GPU if it has one, free on one machine.

Ray waits in silence for room that no machine has, so the question is settled beforehand.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from cluster.errors import UserError
from cluster.runtime.ray_internals import free_resources
from cluster.runtime.session import Session

_PATIENCE_SECONDS = 5.0
_POLL_SECONDS = 0.2


@dataclass(frozen=True)
class FreeNode:
    """What one machine has free."""

    cpus: int
    gpus: int = 0


@dataclass(frozen=True)
class Placement:
    """How many processes of which size run at the same time.

    Attributes:
        processes: how many.
        cpus: of each, on one machine.
        gpus: of each, on the same machine; 0 or 1.
        least: processes to go on with when there is no longer room for all; 0 for all.
    """

    processes: int
    cpus: int
    gpus: int
    least: int = 0

    def __str__(self) -> str:
        """For the person who watches."""
        many = f"{self.processes} processes" if self.processes > 1 else "1 process"
        fewer = f" (or as few as {self.least})" if self.least else ""
        cpus = f"{self.cpus} CPUs" if self.cpus > 1 else "1 CPU"
        return f"{many}{fewer} of {cpus}{' and a GPU' if self.gpus else ''}"

    def fits(self, machines: Sequence[FreeNode]) -> bool:
        """Whether there is room for all of them."""
        return sum(self._room(machine) for machine in machines) >= self.processes

    def _room(self, machine: FreeNode) -> int:
        by_cpus = machine.cpus // self.cpus
        return min(by_cpus, machine.gpus // self.gpus) if self.gpus else by_cpus


def place(
    processes: int,
    cpus: int | Literal["all"],
    machines: Sequence[FreeNode],
    device: Literal["auto", "cpu", "cuda"] = "auto",
) -> Placement:
    """Decide the size of processes.

    Args:
        processes: how many shall run at the same time.
        cpus: of each; `all` for as many as there is room for.
        machines: what is free.
        device: `auto` gives each process a GPU where the cluster has any.

    Returns:
        The placement; with `all`, processes have as many CPUs as still fit.

    Raises:
        UserError: there is no room, or no GPU, with what is free and the remedy.
    """
    has_gpus = any(machine.gpus for machine in machines)
    if device == "cuda" and not has_gpus:
        raise UserError(
            "train.device=cuda asks for a GPU and Ray finds none free: wait for one, add a machine that "
            "has one and a CUDA build of PyTorch, or use --set train.device=auto"
        )
    gpus = 1 if has_gpus and device != "cpu" else 0
    least = 1 if cpus == "all" else cpus
    if not Placement(processes, least, gpus).fits(machines):
        raise UserError(_no_room(Placement(processes, least, gpus), machines))
    largest = max(machine.cpus for machine in machines) if cpus == "all" else least
    sizes = (Placement(processes, size, gpus) for size in range(largest, least - 1, -1))
    return next(placement for placement in sizes if placement.fits(machines))


def free_machines(session: Session) -> list[FreeNode]:
    """What every machine of the cluster has free, once what this command used before is free again."""
    if session.is_local:
        return [FreeNode(session.cpus, session.gpus)]
    deadline = time.monotonic() + _PATIENCE_SECONDS
    while True:
        found = [FreeNode(int(free.get("CPU", 0)), int(free.get("GPU", 0))) for free in free_resources()]
        if sum(machine.cpus for machine in found) >= session.cpus or time.monotonic() > deadline:
            return found
        time.sleep(_POLL_SECONDS)


def _no_room(wanted: Placement, machines: Sequence[FreeNode]) -> str:
    total = wanted.processes * wanted.cpus
    gpus = f" and {wanted.processes} GPUs" if wanted.gpus else ""
    free = ", ".join(
        f"{machine.cpus} CPUs" + (f" and {machine.gpus} GPUs" if wanted.gpus else "") for machine in machines
    )
    return (
        f"this needs {total} CPUs{gpus} at the same time, for {wanted.processes} processes of {wanted.cpus}, "
        f"each on one machine; free are {free or 'none'}; lower train.workers or train.threads with --set, "
        "wait until other work has ended, or use a larger cluster"
    )
