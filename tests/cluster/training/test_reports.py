"""What reaches MLflow of a training whose store fails for a while: its file is damaged, then put back."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import ray

from cluster.errors import UserError
from cluster.progress import ProgressLine
from cluster.runtime.mailbox import mailbox
from cluster.tracking import Run, Tracker, open_tracker
from cluster.training.reports import Reports


@contextmanager
def damaged(tracker: Tracker) -> Iterator[None]:
    database = Path(tracker.uri.removeprefix("sqlite:///"))
    content = database.read_bytes()
    database.write_bytes(b"damaged" * 1000)
    yield
    database.write_bytes(content)


def report(update: int) -> dict[str, Any]:
    metrics = {"held_out/rec_norm": 0.5, "held_out/gen_norm": 0.6}
    return {"stage": "joint", "update": update, "updates": 40, "metrics": metrics}


def recorded(run: Run) -> list[int]:
    """The updates whose measures the store has."""
    history = run.tracker.client.get_metric_history(run.id, "held_out/gen_norm")
    return sorted(point.step for point in history)


def test_a_store_that_failed_is_left_alone_for_a_while_and_misses_nothing_in_the_end(
    tracking_settings, capsys
):
    tracker = open_tracker(tracking_settings)
    with tracker.run("train", "train", {}) as run, ProgressLine("updates", 40, 0) as progress:
        patient, hasty, leaving = (Reports(progress, run, pause) for pause in (3600.0, 0.0, 0.0))
        with damaged(tracker):
            for update, reports in enumerate((patient, hasty, leaving), start=1):
                reports.receive(report(update))
            with pytest.raises(UserError, match="cannot be used"):
                patient.complete()
        leaving.give_up()
        for update, reports in enumerate((patient, hasty, leaving), start=11):
            reports.receive(report(update))
        assert recorded(run) == [2, 12]
        patient.complete()
        assert recorded(run) == [1, 2, 11, 12]
    assert capsys.readouterr().err.count("Training goes on") == 3


def test_a_healthy_store_has_every_report_at_once_whatever_is_ending(tracking_settings):
    with (
        open_tracker(tracking_settings).run("train", "train", {}) as run,
        ProgressLine("updates", 40, 0) as progress,
    ):
        reports = Reports(progress, run)
        reports.receive({"device": "cpu"})
        reports.receive(report(1))
        reports.give_up()
        reports.receive(report(2))
        assert recorded(run) == [1, 2]
        assert run.tracker.client.get_run(run.id).data.tags["svaedc.device"] == "cpu"


@pytest.mark.slow
@pytest.mark.usefixtures("ray_session")
def test_an_interrupted_command_does_not_wait_for_a_record_that_takes_long():
    entered, released, left = threading.Event(), threading.Event(), threading.Event()

    def receive(_: str) -> None:
        entered.set()
        released.wait(300)
        left.set()

    def interrupt() -> None:
        with mailbox(receive) as box:
            ray.get(box.put.remote("first"))
            assert entered.wait(120)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupt()
    assert not left.is_set()
    released.set()
    assert left.wait(120)
