"""What MLflow is told of a collection while its store fails for a while."""

from pathlib import Path

import pytest

from cluster.datasets.progress import CollectionProgress, ProgressRecorder
from cluster.errors import UserError
from cluster.tracking import open_tracker


def test_an_mlflow_store_that_fails_meanwhile_does_not_end_the_collection(tracking_settings, capsys):
    """Its file is damaged for a while: what is recorded later is there."""
    tracker = open_tracker(tracking_settings)
    database = Path(tracker.uri.removeprefix("sqlite:///"))
    counts = CollectionProgress(episodes=8)
    with tracker.run("collect", "collect", {}) as run:
        recorder = ProgressRecorder(run, interval=0.0)
        content = database.read_bytes()
        database.write_bytes(b"damaged" * 1000)
        recorder.record(counts)
        recorder.record(counts)
        with pytest.raises(UserError, match="cannot be used"):
            run.metrics(counts.metrics(), step=8)
        database.write_bytes(content)
        recorder.record(counts)
        assert tracker.client.get_run(run.id).data.metrics["episodes"] == 8
    assert capsys.readouterr().err.count("the collection goes on") == 1
