"""`svaedc collect --plan`: a pilot that is part of the dataset, and an account of how far off it was."""

import json
from pathlib import Path

import pytest

from cluster.config import CollectSettings
from cluster.datasets.collect import collect, collect_pilot
from cluster.datasets.pilot import PLAN, add_cost, begin, review
from cluster.datasets.plan import plan_collection
from cluster.datasets.progress import CollectionProgress
from cluster.errors import UserError
from cluster.tracking import open_tracker
from workers import setups
from workers.collection.forecast import Forecast, Prediction
from workers.dataset.folder import create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.storage.temporary import WRITING

SETTINGS = CollectSettings(actors=2, episodes_per_shard=2)


def job(folder: Path, episodes: int, session, tracker) -> tuple:
    setup = setups.load("franka")
    plan = plan_collection(setup=setup, episodes=episodes, folder=folder, seed=0, settings=SETTINGS)
    return plan, SETTINGS, session, tracker


@pytest.fixture
def dataset(tmp_path):
    """A dataset of no episodes."""
    return create(tmp_path / "dataset", identity_of(setups.load("franka"), seed=0, episodes_per_shard=2))


EXPECTED = Forecast(
    episodes=100,
    actors=2,
    core_hours=Prediction(2.0, 0.1),
    hours=Prediction(1.0, 0.1),
    size=Prediction(1e6, 0.0),
    badness=Prediction(0.5, 0.1),
)


def did(episodes: int, core_hours: float, bad: float = 0.5) -> CollectionProgress:
    return CollectionProgress(
        episodes=episodes,
        rollout_seconds=3600 * core_hours,
        size=12_000 * episodes,
        bad=bad * episodes,
    )


@pytest.mark.slow
def test_a_pilot_is_the_beginning_of_the_dataset_and_is_judged_at_its_end(
    ray_session, tracking_settings, tmp_path, capsys
):
    folder, tracker = tmp_path / "dataset", open_tracker(tracking_settings)
    collect_pilot(*job(folder, 80, ray_session, tracker))
    said = capsys.readouterr().err
    assert "the whole job of 80 episodes on 2 actors, from its first 8" in said
    assert all(f"  {name} " in said for name in ("core-hours", "wall time", "disk", "badness"))
    pilot = {path: path.stat().st_ino for path in folder.glob("*.parquet")}
    assert len(pilot) == 4
    dataset = collect(*job(folder, 80, ray_session, tracker))
    assert dataset.episodes() == 80
    assert all(path.stat().st_ino == number for path, number in pilot.items())
    said = capsys.readouterr().err
    assert "against the plan, 80 of 80 episodes accounted for: core_hours " in said
    plan = json.loads((folder / PLAN).read_text())
    assert plan["off"].keys() == {"core_hours", "hours", "bytes", "badness"}
    assert sum(entry["size"] for entry in plan["spent"]) == dataset.size()
    runs = tracker.client.search_runs([tracker.experiment])
    assert any("plan/core_hours_off" in run.data.metrics for run in runs)
    assert list((folder / WRITING).iterdir()) == []


def test_the_plan_is_no_part_of_the_dataset(dataset):
    before = dataset.fingerprint()
    begin(dataset, 100, EXPECTED, did(10, 0.2))
    assert open_dataset(dataset.folder) == dataset
    assert dataset.fingerprint() == before


def test_how_far_off_a_plan_was_is_its_account_against_it(dataset):
    """Twenty episodes of a killed command are missing in the account: they count on neither side."""
    begin(dataset, 0, EXPECTED, did(20, 0.4))
    add_cost(dataset, did(60, 1.4, bad=0.6), 5400.0)
    off = review(dataset)
    assert off["plan/core_hours_off"] == pytest.approx(1.8 / 1.6 - 1)
    assert off["plan/hours_off"] == pytest.approx(0.75 / 0.8 - 1, abs=1e-3)
    assert off["plan/bytes_off"] == pytest.approx(80 * 12_000 / 8e5 - 1)
    assert off["plan/badness_off"] == pytest.approx((20 * 0.5 + 60 * 0.6) / 80 / 0.5 - 1)


def test_a_plan_is_judged_once_and_not_before_its_end(dataset):
    begin(dataset, 2, EXPECTED, did(20, 0.4))
    assert review(dataset) == {}
    begin(dataset, 0, EXPECTED, did(20, 0.4))
    assert review(dataset)
    kept = (dataset.folder / PLAN).read_text()
    add_cost(dataset, did(60, 1.4), 5400.0)
    assert review(dataset) == {}
    assert (dataset.folder / PLAN).read_text() == kept


@pytest.mark.parametrize("content", ["", "{", "[]", '{"expected": {}}', '{"expected": 1, "spent": [1]}'])
def test_a_plan_that_nobody_can_read_changes_nothing(dataset, content):
    (dataset.folder / PLAN).write_text(content)
    add_cost(dataset, did(60, 1.4), 5400.0)
    assert review(dataset) == {}
    assert (dataset.folder / PLAN).read_text() == content


def test_too_little_to_plan_for_is_refused(ray_session, tracking_settings, tmp_path):
    with pytest.raises(UserError, match=r"2 episodes left to collect in .*: too few to plan for"):
        collect_pilot(*job(tmp_path / "dataset", 2, ray_session, open_tracker(tracking_settings)))
