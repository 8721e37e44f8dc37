"""A whole figure, from data to table, and what is refused before it begins."""

import json

import pytest

from cluster.config import CompareSettings, Settings, TrainSettings
from cluster.errors import UserError
from cluster.reproduction.run import reproduce
from cluster.runtime.session import Session
from cluster.tracking import open_tracker
from tests.cluster.reproduction.tiny import TINY, plan_of


def test_processes_that_training_will_have_no_room_for_are_refused_as_training_does(
    tmp_path, tracking_settings, few_episodes
):
    alone = Session("127.0.0.1:1", is_local=True, cpus=1)
    train = TrainSettings(workers=3, least_workers=2)
    with pytest.raises(UserError, match="this needs 2 CPUs at the same time, for 2 processes of 1"):
        reproduce(
            plan_of(TINY, tmp_path, dataset=few_episodes),
            Settings(compare=CompareSettings(slots=1), train=train),
            alone,
            open_tracker(tracking_settings),
        )


@pytest.mark.slow
def test_a_figure_is_made_from_data_to_table_and_made_again_by_nothing(
    ray_session, tracking_settings, franka_dataset, tmp_path, capsys
):
    settings = Settings(
        train=TrainSettings(
            updates=4, epoch_updates=2, cache_folder=tmp_path / "cache", threads=1, moments=0
        ),
        compare=CompareSettings(pool_size=100),
    )
    reproduction = plan_of(TINY, tmp_path, dataset=franka_dataset)
    arguments = reproduction, settings, ray_session, open_tracker(tracking_settings)
    found = reproduce(*arguments)
    assert all(entry.finding.runs == 2 for entry in found.entries)
    results = reproduction.results
    summary = json.loads((results / "push" / "summary.json").read_text())
    assert summary["title"].splitlines() == [
        "figure-0, push: a push",
        "franka-rehearsal, a simulated stand-in: Bayesian optimisation under hidden physics (wide gap)",
    ]
    assert "simulated stand-in" in (results / "push" / "report.html").read_text()
    assert "model_trained_on" in (results / "push" / "report.html").read_text()
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.jsonl")}
    capsys.readouterr()
    again = reproduce(*arguments)
    said = capsys.readouterr().err
    assert again == found
    assert "is already trained: nothing to do" in said
    assert "holds the whole comparison: nothing to do" in said
    assert before == {path: path.stat().st_mtime_ns for path in before}
