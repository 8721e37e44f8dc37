"""`svaedc train --sweep`: models around a preset, ranked by what they are worth on recorded episodes."""

import json

import pytest

from cluster.collect import collect
from cluster.config import CollectSettings, TrainSettings
from cluster.errors import UserError
from cluster.sweep import CHANGES, sweep
from cluster.tracking import open_tracker
from svaedc.presets import Sizes, preset
from svaedc.variants import varied
from workers import setups


@pytest.mark.parametrize("name", sorted(set(CHANGES) - {"preset"}))
def test_every_point_of_the_sweep_is_another_model_than_the_preset(name):
    settings = TrainSettings().model_copy(update={**CHANGES[name]})
    made = preset("compact")(Sizes(48, 25, 100))
    assert varied(made, settings.changes()) != made or settings.stride != TrainSettings().stride


def test_a_dataset_too_small_for_a_sweep_is_refused(franka_dataset, ray_session, tracking_settings, tmp_path):
    with pytest.raises(UserError, match=r"holds 240 episodes, a sweep needs at least 500"):
        sweep(
            folder=franka_dataset,
            model=tmp_path / "model",
            preset="compact",
            seed=0,
            settings=TrainSettings(cache_folder=tmp_path / "cache"),
            session=ray_session,
            tracker=open_tracker(tracking_settings),
        )


@pytest.mark.slow
def test_a_sweep_trains_measures_and_ranks_its_models_and_repeats_none(
    ray_session, tracking_settings, tmp_path, capsys
):
    tracker = open_tracker(tracking_settings)
    collect(
        setup=setups.load("franka"),
        episodes=520,
        folder=tmp_path / "dataset",
        seed=0,
        repeats=1,
        settings=CollectSettings(actors=2, episodes_per_shard=130),
        session=ray_session,
        tracker=tracker,
    )

    def run():
        return sweep(
            folder=tmp_path / "dataset",
            model=tmp_path / "model",
            preset="compact",
            seed=0,
            settings=TrainSettings(updates=30, cache_folder=tmp_path / "cache"),
            session=ray_session,
            tracker=tracker,
            changes={"preset": {}, "kl-3": {"kl_weight": 3.0}, "stride-10": {"stride": 10}},
        )

    table = run().read_text()
    results = {
        path.parent.name: json.loads(path.read_text())
        for path in (tmp_path / "model" / "sweep").glob("*/result.json")
    }
    ranked = [line.split(" | ")[0].strip("| ") for line in table.splitlines()[4:]]
    assert set(ranked) == results.keys() == {"preset", "kl-3", "stride-10"}
    worths = [results[name]["svae-dc"]["best"] for name in ranked]
    assert worths == sorted(worths, reverse=True)
    written = (tmp_path / "model" / "sweep" / "kl-3" / "model.pt").stat().st_mtime_ns
    run()
    assert "3 of them trained already" in capsys.readouterr().err
    assert (tmp_path / "model" / "sweep" / "kl-3" / "model.pt").stat().st_mtime_ns == written
    names = {each.info.run_name for each in tracker.client.search_runs([tracker.experiment])}
    assert {"sweep compact", "preset", "kl-3", "stride-10"} <= names
