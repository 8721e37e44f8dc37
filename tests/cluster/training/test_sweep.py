"""`svaedc train --sweep`: models around a preset, ranked by what they are worth on recorded episodes."""

import json
import math
from pathlib import Path

import pytest

from cluster.config import CollectSettings, TrainSettings
from cluster.datasets.collect import collect
from cluster.datasets.plan import plan_collection
from cluster.errors import UsageError, UserError
from cluster.files import write_json
from cluster.runtime.session import Session
from cluster.tracking import open_tracker
from cluster.training.sweep import CHANGES, require_one_cpu, sweep
from cluster.training.sweep_worker import RESULT, SweepPoint
from cluster.training.train import working_in
from cluster.training.worker import TrainingJob
from svaedc.training.presets import Sizes, preset, vary
from workers import setups


@pytest.mark.parametrize("name", sorted(set(CHANGES) - {"preset"}))
def test_every_point_of_the_sweep_is_another_model_than_the_preset(name):
    settings = TrainSettings().model_copy(update={**CHANGES[name]})
    made = preset("compact")(Sizes(48, 25, 100))
    assert vary(made, settings.changes()) != made or settings.stride != TrainSettings().stride


@pytest.mark.parametrize(
    "asked",
    [{"workers": 2}, {"least_workers": 2}, {"threads": 2}, {"device": "cuda"}, {"precision": "bfloat16"}],
)
def test_settings_that_a_sweep_does_not_follow_are_refused_by_name(asked):
    with pytest.raises(UsageError, match=rf"one CPU in float32, train\.{next(iter(asked))} asks for"):
        require_one_cpu(TrainSettings(**asked))


def test_settings_that_a_sweep_follows_are_not_refused():
    passed = [TrainSettings(), TrainSettings(threads=1, device="cpu", precision="float32", least_workers=1)]
    assert [require_one_cpu(settings) for settings in passed] == [None, None]


def point(folder: Path, updates: int = 100, **origin: object) -> SweepPoint:
    """A point whose folder is below `folder`; its dataset is not looked at."""
    made = {
        "setup": "franka",
        "dataset": "0" * 64,
        "preset": "compact",
        "seed": 0,
        "changes": {"kl_weight": 3.0},
    }
    job = TrainingJob(
        dataset=folder / "dataset",
        model=folder / "kl-3",
        cache=folder / "cache",
        origin={**made, **origin},
        preset="compact",
        updates=updates,
        stride=5,
        seed=0,
        time_limit=float("inf"),
        checkpoint_every=1,
    )
    return SweepPoint("kl-3", job, updates)


def written(of: SweepPoint) -> SweepPoint:
    """The same point, with the result that its sweep leaves."""
    of.job.model.mkdir(parents=True)
    result = {"name": of.name, "origin": of.job.origin, "updates": of.updates, "update": of.updates}
    write_json(of.job.model / RESULT, {**result, "svae-dc": {"best": 0.5}})
    return of


def test_a_point_takes_up_its_own_result(tmp_path):
    assert point(tmp_path).result == {}
    assert written(point(tmp_path)).result["svae-dc"] == {"best": 0.5}


def test_measures_that_are_no_numbers_come_back_as_they_were(tmp_path):
    made = written(point(tmp_path))
    content = {**made.result, "metrics": {"corr_y_gen": math.nan, "rec_norm": 0.5}}
    write_json(made.job.model / RESULT, content)
    found = json.loads((made.job.model / RESULT).read_text(), parse_constant=pytest.fail)
    assert found["metrics"] == {"corr_y_gen": None, "rec_norm": 0.5}
    measures = made.result["metrics"]
    assert (math.isnan(measures["corr_y_gen"]), measures["rec_norm"]) == (True, 0.5)


@pytest.mark.parametrize(
    ("other", "named"),
    [
        ({"updates": 4000}, "updates 100, not 4000"),
        ({"dataset": "1" * 64}, "dataset '000000.*', not '111111"),
        ({"seed": 1}, "seed 0, not 1"),
        ({"preset": "paper"}, "preset 'compact', not 'paper'"),
        ({"changes": {"kl_weight": 3.0, "latent": "5x6"}}, "changes .*5x6"),
    ],
)
def test_a_result_of_another_sweep_is_refused_naming_what_differs(tmp_path, other, named):
    written(point(tmp_path))
    with pytest.raises(UserError, match=rf"result\.json was made for {named}.*another --model folder"):
        point(tmp_path, **other).result  # noqa: B018 - the look alone is refused


def test_a_result_that_does_not_say_what_it_is_of_counts_as_none(tmp_path):
    (tmp_path / "kl-3").mkdir()
    write_json(tmp_path / "kl-3" / RESULT, {"name": "kl-3", "metrics": {}, "svae-dc": {"best": 0.5}})
    assert point(tmp_path).result == {}


def test_a_dataset_too_small_for_a_sweep_and_a_cluster_without_a_free_cpu_are_refused(
    franka_dataset, ray_session, tracking_settings, tmp_path
):
    tracker = open_tracker(tracking_settings)
    full = Session("127.0.0.1:1", is_local=False, cpus=0)
    for session, refusal in (
        (ray_session, r"holds 240 episodes, a sweep needs at least 500"),
        (full, r"this needs 1 CPUs at the same time, the cluster at 127.0.0.1:1 has 0 free"),
    ):
        with pytest.raises(UserError, match=refusal):
            sweep(
                folder=franka_dataset,
                model=tmp_path / "model",
                preset="compact",
                seed=0,
                settings=TrainSettings(cache_folder=tmp_path / "cache"),
                session=session,
                tracker=tracker,
            )


@pytest.mark.slow
def test_a_sweep_trains_measures_and_ranks_its_models_and_repeats_none(
    ray_session, tracking_settings, tmp_path, capsys
):
    tracker = open_tracker(tracking_settings)
    collect(
        plan_collection(
            setup=setups.load("franka"),
            episodes=520,
            folder=tmp_path / "dataset",
            seed=0,
            repeats=1,
            settings=CollectSettings(actors=2, episodes_per_shard=130),
        ),
        CollectSettings(actors=2, episodes_per_shard=130),
        ray_session,
        tracker,
    )

    def run(**more):
        return sweep(
            folder=tmp_path / "dataset",
            model=tmp_path / "model",
            preset="compact",
            seed=0,
            settings=TrainSettings(updates=30, epoch_updates=15, cache_folder=tmp_path / "cache", **more),
            session=ray_session,
            tracker=tracker,
            changes={"preset": {}, "kl-3": {"kl_weight": 3.0}, "stride-10": {"stride": 10}},
        )

    with pytest.raises(UserError, match=r"3 of 3 models were stopped by train\.time_limit_seconds"):
        run(time_limit_seconds=1e-6)
    assert not list((tmp_path / "model").rglob("result.json"))
    with working_in(tmp_path / "model"), pytest.raises(UserError, match="another training is at work in"):
        run()
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
    with pytest.raises(UserError, match=r"changes .*balanced.*another --model folder"):
        run(weighting="balanced")
    names = {each.info.run_name for each in tracker.client.search_runs([tracker.experiment])}
    assert {"sweep compact", "preset", "kl-3", "stride-10"} <= names
