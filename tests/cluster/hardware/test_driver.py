"""The Ray side: one serialized actor, never restarted, never retried, and what its death leaves behind."""

import os
import signal
import subprocess
import sys
import threading
import time
from contextlib import closing
from pathlib import Path

import pytest
import ray

from cluster.config import HardwareSettings, TrackingSettings
from cluster.errors import UserError
from cluster.hardware import connect, lock, operator
from cluster.hardware.actor import HardwareActor, actor_options
from cluster.hardware.driver import start
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.robot.residence import home_of_campaign
from cluster.hardware.states import Approval, State
from cluster.hardware.status import Phase
from cluster.runtime.session import Session
from cluster.tracking import open_tracker
from tests.cluster.hardware.desk import opened
from workers.host.serve import STARTED

ROOT = Path(__file__).parents[3]
LONG_PACE_SECONDS = 600.0


def plan_in(folder, pace=0.0, trials=1, approval=Approval.POLICY):
    identity = identify("franka-rehearsal", "random", trials, 3, 10, None, approval)
    return CampaignPlan(identity, folder, None, pace)


@pytest.fixture
def settings(request):
    """A namespace of its own for every test: one that fails leaves its actor to nobody."""
    return HardwareSettings(namespace=request.node.name)


@pytest.fixture(scope="module")
def tracker(tmp_path_factory):
    return open_tracker(TrackingSettings(uri=f"sqlite:///{tmp_path_factory.mktemp('store')}/mlflow.db"))


def when(condition, act, seconds=120.0):
    """Watches from a thread, and acts as soon as the condition holds."""

    def watch():
        deadline = time.monotonic() + seconds
        while time.monotonic() < deadline:
            if condition():
                act()
                return
            time.sleep(0.02)

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    return thread


def starts(folder):
    """Names of the campaign's trials that ever moved the robot, from its ledger."""
    try:
        name = operator.status(folder).name
    except UserError:
        return []
    entries = home_of_campaign(folder, "franka-rehearsal").ledger.entries()
    trials = [entry.facts["trial"] for entry in entries if entry.event == STARTED]
    return [trial for trial in trials if trial.startswith(name)]


def state_of(folder, number):
    try:
        with closing(opened(folder)) as book:
            return book.trial(number).state
    except UserError:
        return None


def moving(folder):
    return state_of(folder, 0) is State.RUNNING and len(starts(folder)) == 1


def test_nothing_ray_does_can_start_a_trial_twice():
    options = actor_options("franka-rehearsal", "lab", "detached")
    assert options == {
        "name": "hardware-franka-rehearsal",
        "namespace": "lab",
        "lifetime": "detached",
        "num_cpus": 0,
        "resources": {"hardware": 1},
        "max_concurrency": 1,
        "max_restarts": 0,
        "max_task_retries": 0,
    }


def test_a_campaign_runs_to_its_end_and_every_trial_is_tracked(ray_session, tracker, settings, tmp_path):
    reports = []
    last = start(settings, ray_session, tracker, plan_in(tmp_path), reports.append, print)
    assert last.phase is Phase.COMPLETE
    assert [report.measured for report in reports] == [0, 1, 2, 3]
    [run] = tracker.client.search_runs([tracker.experiment], f"tags.`svaedc.campaign` = '{last.name}'")
    best = tracker.client.get_metric_history(run.info.run_id, "best")
    f = [trial.f for trial in last.trials]
    assert [(point.step, point.value) for point in best] == [(0, f[0]), (1, max(f[:2])), (2, max(f))]
    assert run.data.params["method"] == "random"


@pytest.mark.slow
def test_a_complete_campaign_is_shown_again_without_motion(ray_session, tracker, settings, tmp_path):
    plan = plan_in(tmp_path, trials=0)
    first = start(settings, ray_session, tracker, plan, lambda _: None, print)
    again = start(settings, ray_session, tracker, plan, lambda _: None, print)
    assert again.trials == first.trials
    assert len(starts(tmp_path)) == 2


@pytest.mark.slow
def test_a_killed_actor_leaves_its_trial_unknown_and_it_is_not_repeated(
    ray_session, tracker, settings, tmp_path
):
    killer = when(lambda: moving(tmp_path), lambda: os.kill(lock.holder(tmp_path).pid, signal.SIGKILL))
    slow = plan_in(tmp_path, pace=LONG_PACE_SECONDS)
    with pytest.raises(
        UserError, match=r"lost the process at the robot; trial 0 may have moved .*never ended"
    ):
        start(settings, ray_session, tracker, slow, lambda _: None, print)
    killer.join()
    assert state_of(tmp_path, 0) is State.UNKNOWN
    assert len(starts(tmp_path)) == 1
    operator.resolve(tmp_path, 0, "aborted", "Ada", "it was cut", None, None)
    last = start(settings, ray_session, tracker, plan_in(tmp_path), lambda _: None, print)
    assert [trial.state for trial in last.trials] == ["aborted", "measured", "measured", "measured"]
    assert len(set(starts(tmp_path))) == len(starts(tmp_path)) == 4


@pytest.mark.slow
def test_a_waiting_campaign_goes_on_when_a_person_approves(ray_session, tracker, settings, tmp_path):
    approvers = [
        when(
            lambda number=number: state_of(tmp_path, number) is State.CHECKED,
            lambda number=number: operator.approve(tmp_path, number, "Ada"),
        )
        for number in range(2)
    ]
    plan = plan_in(tmp_path, trials=0, approval=Approval.OPERATOR)
    reports = []
    last = start(settings, ray_session, tracker, plan, reports.append, print)
    assert last.phase is Phase.COMPLETE
    assert Phase.AWAITS_APPROVAL in {report.phase for report in reports}
    for approver in approvers:
        approver.join()


def test_a_cluster_without_a_robot_is_refused(ray_session, tracker, settings, tmp_path, monkeypatch):
    monkeypatch.setattr(connect, "RESOURCE", "robot-arm")
    with pytest.raises(UserError, match="no machine of the Ray cluster offers the resource 'robot-arm'"):
        start(settings, ray_session, tracker, plan_in(tmp_path), lambda _: None, print)


@pytest.mark.slow
def test_a_folder_of_another_campaign_is_refused_and_the_robot_is_free_afterwards(
    ray_session, tracker, settings, tmp_path
):
    start(settings, ray_session, tracker, plan_in(tmp_path, trials=0), lambda _: None, print)
    with pytest.raises(UserError, match="holds a campaign with trials '0', asked for '1'"):
        start(settings, ray_session, tracker, plan_in(tmp_path, trials=1), lambda _: None, print)
    last = start(settings, ray_session, tracker, plan_in(tmp_path / "other"), lambda _: None, print)
    assert last.phase is Phase.COMPLETE


@pytest.fixture
def neighbour(ray_session, settings):  # noqa: ARG001 - Ray must be connected
    """The actor of a killed command: it holds the robot's machine, for another robot."""
    options = actor_options("yumi-rehearsal", settings.namespace, "detached")
    actor = ray.remote(HardwareActor).options(**options).remote()
    ray.wait([actor.__ray_ready__.remote()], timeout=120)
    yield actor
    ray.kill(actor)


def is_there(robot, namespace):
    try:
        return ray.get_actor(f"hardware-{robot}", namespace) is not None
    except ValueError:
        return False


def gone(robot, namespace, seconds=60.0):
    deadline = time.monotonic() + seconds
    while is_there(robot, namespace) and time.monotonic() < deadline:
        time.sleep(0.1)
    return not is_there(robot, namespace)


@pytest.mark.slow
@pytest.mark.usefixtures("neighbour")
def test_a_robots_machine_that_is_taken_ends_the_command_which_names_who_took_it(
    ray_session, tracker, settings, tmp_path, monkeypatch
):
    monkeypatch.setattr(connect, "PLACE_SECONDS", 2.0)
    monkeypatch.setattr(connect, "NOTICE_SECONDS", 0.0)
    joined = Session(ray_session.address, is_local=False, cpus=ray_session.cpus)
    said = []
    name = f"hardware-yumi-rehearsal in the namespace '{settings.namespace}'"
    with pytest.raises(UserError, match=f"is taken by {name}; wait until that campaign has ended"):
        start(settings, joined, tracker, plan_in(tmp_path), lambda _: None, said.append)
    assert [name in sentence for sentence in said] == [True]
    assert gone("franka-rehearsal", settings.namespace)
    assert is_there("yumi-rehearsal", settings.namespace)
    assert starts(tmp_path) == []


@pytest.mark.slow
def test_a_command_interrupted_while_it_waits_leaves_nothing_behind(
    ray_session, tracker, settings, tmp_path, neighbour, monkeypatch
):
    def interrupt(_):
        raise KeyboardInterrupt

    monkeypatch.setattr(connect, "NOTICE_SECONDS", 0.0)
    joined = Session(ray_session.address, is_local=False, cpus=ray_session.cpus)
    with pytest.raises(KeyboardInterrupt):
        start(settings, joined, tracker, plan_in(tmp_path), lambda _: None, interrupt)
    assert gone("franka-rehearsal", settings.namespace)
    ray.kill(neighbour)
    last = start(settings, joined, tracker, plan_in(tmp_path), lambda _: None, print)
    assert last.phase is Phase.COMPLETE
    assert gone("franka-rehearsal", settings.namespace)


@pytest.mark.slow
@pytest.mark.usefixtures("neighbour")
def test_an_actor_that_was_there_before_survives_a_command_that_found_no_place(
    ray_session, tracker, settings, tmp_path, monkeypatch
):
    monkeypatch.setattr(connect, "PLACE_SECONDS", 2.0)
    options = actor_options("franka-rehearsal", settings.namespace, "detached")
    waiting = ray.remote(HardwareActor).options(**options).remote()
    with pytest.raises(UserError, match="is taken by hardware-yumi-rehearsal"):
        start(settings, ray_session, tracker, plan_in(tmp_path), lambda _: None, print)
    assert not gone("franka-rehearsal", settings.namespace, seconds=2.0)
    ray.kill(waiting)


DRIVER = """
import sys
from pathlib import Path
from cluster.config import HardwareSettings, RaySettings, TrackingSettings
from cluster.hardware.driver import start
from cluster.hardware.states import Approval
from cluster.hardware.plan import CampaignPlan, identify
from cluster.runtime.session import connect
from cluster.tracking import open_tracker

if __name__ == "__main__":
    address, namespace, folder, store, pace = sys.argv[1:]
    identity = identify("franka-rehearsal", "random", 1, 3, 10, None, Approval.POLICY)
    plan = CampaignPlan(identity, Path(folder), None, float(pace))
    tracker = open_tracker(TrackingSettings(uri=f"sqlite:///{store}"))
    ray_settings = RaySettings(num_cpus=1, object_store_memory=100_000_000)
    with connect(ray_settings, address or None) as session:
        start(HardwareSettings(namespace=namespace), session, tracker, plan, lambda _: None, print)
"""


def driving(tmp_path, address, namespace, pace):
    """The start command in a process of its own."""
    arguments = [address, namespace, tmp_path / "campaign", tmp_path / "mlflow.db", str(pace)]
    return subprocess.Popen([sys.executable, "-c", DRIVER, *arguments], cwd=ROOT)


def kill_in_motion(process, folder):
    watched = when(lambda: moving(folder), process.kill)
    assert process.wait(timeout=180) == -signal.SIGKILL
    watched.join()


@pytest.mark.slow
def test_a_trial_outlives_its_driver_where_the_cluster_does(ray_session, tracker, settings, tmp_path):
    folder = tmp_path / "campaign"
    pace = 8.0
    kill_in_motion(driving(tmp_path, ray_session.address, settings.namespace, pace), folder)
    assert lock.holder(folder) is not None
    joined = Session(ray_session.address, is_local=False, cpus=ray_session.cpus)
    last = start(settings, joined, tracker, plan_in(folder, pace=pace), lambda _: None, print)
    assert [trial.state for trial in last.trials] == ["measured", "measured", "measured"]
    assert len(starts(folder)) == 3


@pytest.mark.slow
def test_a_killed_local_driver_leaves_an_unknown_trial_and_then_goes_on(tmp_path):
    folder = tmp_path / "campaign"
    kill_in_motion(driving(tmp_path, "", "lab", LONG_PACE_SECONDS), folder)
    assert driving(tmp_path, "", "lab", 0.0).wait(timeout=180) != 0
    assert state_of(folder, 0) is State.UNKNOWN
    assert len(starts(folder)) == 1
    operator.resolve(folder, 0, "measured", "Ada", "seen", 0.25, 0.5)
    assert driving(tmp_path, "", "lab", 0.0).wait(timeout=180) == 0
    assert operator.status(folder).phase is Phase.COMPLETE
    assert len(set(starts(folder))) == len(starts(folder)) == 3


@pytest.mark.slow
def test_a_second_command_is_refused_and_told_who_drives_the_robot(
    ray_session, tracker, settings, tmp_path, monkeypatch
):
    monkeypatch.setattr(connect, "TAKEOVER_SECONDS", 1.0)
    folder = tmp_path / "campaign"
    first = driving(tmp_path, ray_session.address, settings.namespace, LONG_PACE_SECONDS)
    try:
        deadline = time.monotonic() + 180
        while not moving(folder) and time.monotonic() < deadline:
            time.sleep(0.1)
        joined = Session(ray_session.address, is_local=False, cpus=ray_session.cpus)
        with pytest.raises(
            UserError, match=rf"is driven by another command already, process {first.pid} on 127"
        ):
            start(settings, joined, tracker, plan_in(folder), lambda _: None, print)
        assert state_of(folder, 0) is State.RUNNING
    finally:
        os.kill(lock.holder(folder).pid, signal.SIGKILL)
        first.kill()
        first.wait()
