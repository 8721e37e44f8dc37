"""`svaedc collect` under random SIGKILLs of whatever takes part in it: the bytes stay the same.

The kills are drawn from a seed that is printed: CHAOS_SEED=N make chaos draws them again. CHAOS_SETUP=NAME
collects of another robot.
"""

import os
import subprocess
import time
from contextlib import suppress
from pathlib import Path

import pytest
from ray._private.node import Node
from ray.cluster_utils import Cluster

from tests.chaos import victims
from tests.chaos.drivers import (
    PATIENCE,
    Blows,
    Drivers,
    begun,
    command,
    published,
    require_part,
    require_same,
    seed,
)
from tests.cluster.conftest import MACHINE

pytestmark = pytest.mark.chaos

ALONE, TOGETHER = 100, 100
"""Kills of one driver with Ray of its own, and of two on a cluster."""
BLOWS_OF_A_LIFE, BLOWS_OF_A_PAIR = 24, 50
"""The most that one driver's actors may get, and that two may before they are left in peace."""
EXPECTED_ENDS = (
    *("Ray has ended on this machine", "Ray cannot start here"),
    *("shards kept failing", "no worker process could start"),
)


def lived(driver: subprocess.Popen, folder: Path, blows: Blows) -> int:
    """Kill the actors of a driver, then it or its Ray or nothing; returns how it ended."""
    many = int(blows.rng.choice([0, blows.rng.integers(1, BLOWS_OF_A_LIFE)], p=[0.25, 0.75]))
    last = blows.rng.choice(["driver", "raylet", "nothing"], p=[0.5, 0.35, 0.15])
    blows.wait(8.0)  # somewhere in its start
    deadline = time.monotonic() + PATIENCE
    while many and driver.poll() is None:
        assert time.monotonic() < deadline
        blows.pause(folder, lambda: driver.poll() is not None)
        many -= blows.actor(driver.pid)
    if last != "nothing":
        getattr(blows, last)(driver)
    return driver.wait(PATIENCE)


def require_explained(code: int, log: Path) -> None:
    """A driver that was not killed ends well, or says what befell it; never with a traceback."""
    said = log.read_text()
    assert "Traceback" not in said
    assert code <= 0 or any(reason in said for reason in EXPECTED_ENDS), said


def test_no_kill_of_driver_actors_or_ray_changes_a_byte(tmp_path, undisturbed, drivers):
    blows, finished, unfinished = Blows(tmp_path, seed()), 0, None
    print(f"CHAOS_SEED={blows.seed}")
    while blows.dealt.total() < ALONE or not finished:
        folder, log = tmp_path / f"dataset-{finished}", tmp_path / f"after-{blows.dealt.total()}-kills.log"
        unfinished = unfinished or begun(folder)
        code = lived(drivers.start(command(folder, tmp_path / "mlflow.db"), log), folder, blows)
        require_explained(code, log)
        require_part(folder, undisturbed)
        if published(folder).keys() == undisturbed.keys():
            # The next command finds nothing to do: what it shall sweep must have no living writer any more.
            assert victims.wait_until_gone(blows.seen, PATIENCE) == set()
        if code == 0:
            require_same(folder, undisturbed, [unfinished])
            unfinished, finished = None, finished + 1
            print(f"{blows}; {finished} collections finished")
    assert victims.wait_until_gone(blows.seen, PATIENCE) == set()


class Pair:
    """Two drivers on one dataset, each started again whenever it was killed or has given up."""

    def __init__(self, drivers: Drivers, folder: Path, address: str, log: Path) -> None:
        self._drivers = drivers
        self._commands = [
            command(folder, log.with_suffix(f".{seat}.db"), "--address", address) for seat in range(2)
        ]
        self._log = log
        self.seats = [drivers.start(command, log) for command in self._commands]

    def tend(self) -> None:
        """Start again what has not reached the end."""
        for seat, process in enumerate(self.seats):
            if process.poll() not in (None, 0):
                self.seats[seat] = self._drivers.start(self._commands[seat], self._log)

    def is_over(self) -> bool:
        """Whether one of the two has reached the end."""
        return any(process.poll() == 0 for process in self.seats)

    def end(self) -> None:
        """Wait until both have reached the end, now that nobody disturbs them any more."""
        deadline = time.monotonic() + PATIENCE
        while any(process.poll() != 0 for process in self.seats):
            assert time.monotonic() < deadline, self._log.read_text()
            self.tend()
            time.sleep(0.1)


def joined(machines: Cluster) -> Node:
    """One machine more. Ray gives up one that starts for half a minute, as it may on a busy machine."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        with suppress(Exception):  # Ray raises bare ones
            return machines.add_node(wait=False, num_cpus=4, **MACHINE)
    raise TimeoutError("no machine could be added to the cluster")


def deal(blows: Blows, pair: Pair, machines: Cluster, others: list[Node]) -> None:
    """One blow to something that two drivers need: mostly an actor, at times a driver or a machine."""
    kind, seat = blows.rng.choice(["actor", "driver", "machine"], p=[0.8, 0.12, 0.08]), blows.rng.integers(2)
    if kind == "actor":
        blows.actor(os.getpid())
    elif kind == "driver":
        blows.driver(pair.seats[seat])
    else:
        machines.remove_node(others.pop(seat), allow_graceful=False)
        blows.dealt["machine"] += 1
        others.append(joined(machines))


def test_no_kill_of_two_drivers_or_a_machine_on_a_cluster_changes_a_byte(
    tmp_path, undisturbed, machines, drivers
):
    blows, finished = Blows(tmp_path, seed()), 0
    print(f"CHAOS_SEED={blows.seed}")
    others = [joined(machines) for _ in range(2)]
    while blows.dealt.total() < TOGETHER:
        folder, log = tmp_path / f"dataset-{finished}", tmp_path / f"pair-{finished}.log"
        unfinished, enough = begun(folder), blows.dealt.total() + BLOWS_OF_A_PAIR
        pair = Pair(drivers, folder, machines.address, log)
        while not pair.is_over() and blows.dealt.total() < enough:
            blows.pause(folder, pair.is_over)
            deal(blows, pair, machines, others)
            pair.tend()
        pair.end()
        assert "Traceback" not in log.read_text()
        require_same(folder, undisturbed, [unfinished])
        finished += 1
        print(f"{blows}; {finished} collections finished by two drivers at once")
