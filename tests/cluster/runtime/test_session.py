"""Joining and starting clusters, each real, each on loopback."""

import os
import socket
import subprocess
import sys

import pytest

from cluster.config import RaySettings
from cluster.errors import UsageError, UserError
from cluster.runtime.session import Session, connect

JOIN = """
import sys
from cluster.config import RaySettings
from cluster.errors import UserError
from cluster.runtime.session import connect
try:
    with connect(RaySettings(temporary_folder=sys.argv[2]), sys.argv[1] or None) as session:
        print("joined", session.address, session.cpus, session.is_local)
except UserError as error:
    print("refused", error)
"""

HOLD = """
import sys
import ray
from cluster.config import RaySettings
from cluster.runtime.session import connect
class Holder:
    def ready(self):
        pass
with connect(RaySettings(temporary_folder=sys.argv[2]), sys.argv[1]):
    holder = ray.remote(Holder).options(num_cpus=3).remote()
    ray.get(holder.ready.remote())
    print("holding", flush=True)
    sys.stdin.read()
"""


CHATTER = """
import sys, time
from pathlib import Path
import ray
from cluster.config import RaySettings
from cluster.runtime.session import connect
class Talker:
    def talk(self, megabytes):
        for number in range(10_000 * megabytes):
            print(f"{number:099d}")
with connect(RaySettings(num_cpus=1, log_file_bytes=500_000), None):
    logs = Path(ray._private.worker._global_node.get_logs_dir_path())
    talker = ray.remote(Talker).remote()
    ray.get(talker.talk.remote(5))
    ray.get(talker.__ray_ready__.remote())
    print("logs", sum(path.stat().st_size for path in logs.rglob("*") if path.is_file()))
    print("out", max(path.stat().st_size for path in logs.glob("worker-*.out*")))
"""

SLOW_ONCE = """
import ray
from cluster.config import RaySettings
from cluster.runtime.session import connect
start, refused = ray.init, []
def busy(**arguments):
    if refused:
        return start(**arguments)
    refused.append(arguments)
    raise Exception("The current node timed out during startup. This could happen because ...")
ray.init = busy
with connect(RaySettings(num_cpus=1), None, ()) as session:
    print("started", session.cpus, len(refused))
"""


def join(head, address, **environment) -> str:
    """What a new process prints when it joins, with the given variables and no others about Ray."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("RAY_")}
    command = [sys.executable, "-c", JOIN, address, str(head.folder)]
    clean |= {"RAY_USAGE_STATS_ENABLED": "0", "HOME": str(head.home), **environment}
    return subprocess.run(
        command, env=clean, capture_output=True, text=True, timeout=180, check=True
    ).stdout.strip()


def test_the_right_token_joins_without_naming_the_mode(head):
    assert join(head, head.address, RAY_AUTH_TOKEN=head.token) == f"joined {head.address} 4 False"


def test_auto_finds_the_cluster_of_this_machine(head):
    assert join(head, "auto", RAY_AUTH_TOKEN=head.token) == f"joined {head.address} 4 False"


def test_a_submitted_jobs_address_is_joined_without_being_named(head):
    answer = join(head, "", RAY_AUTH_TOKEN=head.token, RAY_ADDRESS=head.address, RAY_AUTH_MODE="token")
    assert answer == f"joined {head.address} 4 False"


@pytest.mark.parametrize("environment", [{}, {"RAY_AUTH_TOKEN": "b" * 64}], ids=["no token", "another token"])
def test_a_refused_token_says_what_to_set(head, environment):
    answer = join(head, head.address, **environment)
    assert answer.startswith(f"refused the Ray cluster at {head.address} refuses this user's token")
    assert "RAY_AUTH_MODE=token" in answer


def test_an_address_where_nothing_listens_is_refused_with_the_remedy(free_port):
    address = f"127.0.0.1:{free_port}"
    with (
        pytest.raises(UserError, match=rf"no Ray cluster answers at {address}: .*--address"),
        connect_to(address),
    ):
        pass


@pytest.mark.parametrize(
    "address", ["http://127.0.0.1:8265", "ray://127.0.0.1:10001", "somewhere", ":6379", "a:b"]
)
def test_a_malformed_address_is_a_usage_error(address):
    with pytest.raises(UsageError, match="host:port or auto"), connect_to(address):
        pass


def test_auto_without_a_cluster_says_how_to_start_one(tmp_path):
    settings = RaySettings(temporary_folder=tmp_path)
    with pytest.raises(UserError, match="ray start --head"), connect(settings, "auto"):
        pass


@pytest.mark.slow
def test_a_machine_too_busy_to_start_a_cluster_at_once_is_asked_again():
    """Ray's words for it, without the half minute that a machine would have to be too busy for."""
    answer = subprocess.run([sys.executable, "-c", SLOW_ONCE], capture_output=True, text=True, timeout=180)
    assert answer.stdout.strip() == "started 1 1"


def connect_to(address):
    return connect(RaySettings(connect_timeout_seconds=1.0), address)


def test_a_local_cluster_offers_one_hardware_slot(ray_session):
    import ray

    assert ray_session.is_local
    assert ray_session.cpus == 4
    assert ray.cluster_resources()["hardware"] == 1


def niceness():
    return os.nice(0)


def test_workers_have_the_same_share_of_a_busy_machine_as_their_driver(ray_session):
    """Ray would start them at 15, which leaves a thirtieth beside other work on every core."""
    import ray

    assert ray_session.is_local
    assert ray.get(ray.remote(niceness).remote()) == os.nice(0)


def test_a_local_cluster_is_reachable_from_this_machine_only(ray_session):
    port = int(ray_session.address.rpartition(":")[2])
    with socket.socket() as inside:
        assert inside.connect_ex(("127.0.0.1", port)) == 0
    with socket.socket() as outside:
        assert outside.connect_ex(("127.0.0.2", port)) != 0


def test_cpus_that_others_hold_are_not_offered(head):
    holder = subprocess.Popen(
        [sys.executable, "-c", HOLD, head.address, str(head.folder)],
        env={**os.environ, "RAY_AUTH_TOKEN": head.token, "HOME": str(head.home)},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    with holder:
        assert holder.stdout.readline() == "holding\n"
        assert join(head, head.address, RAY_AUTH_TOKEN=head.token) == f"joined {head.address} 1 False"
        holder.stdin.close()


def test_preflight_names_what_is_there_and_what_is_missing():
    local = Session("127.0.0.1:6379", is_local=True, cpus=2)
    with pytest.raises(UserError, match=r"needs 3 CPUs .* has 2; .*--set ray\.num_cpus=3"):
        local.preflight(3)


def test_preflight_on_a_shared_cluster_advises_to_wait():
    shared = Session("10.0.0.1:6379", is_local=False, cpus=2)
    with pytest.raises(UserError, match=r"needs 3 CPUs .* has 2 free; .*wait until other work"):
        shared.preflight(3)


def test_preflight_passes_when_exactly_enough_is_there():
    assert Session("10.0.0.1:6379", is_local=False, cpus=2).preflight(2) is None


@pytest.mark.slow
def test_the_logs_of_a_talkative_worker_stay_bounded():
    """It prints five megabytes, of which two files of half a megabyte may remain."""
    command = [sys.executable, "-c", CHATTER]
    found = subprocess.run(command, capture_output=True, text=True, timeout=180, check=True).stdout.split()
    sizes = dict(zip(found[::2], map(int, found[1::2]), strict=True))
    assert 100_000 < sizes["out"] <= 600_000
    assert sizes["logs"] < 3_000_000
