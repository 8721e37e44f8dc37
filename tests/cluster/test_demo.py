"""What the demo says at its end, and what it refuses before its beginning."""

import json
from dataclasses import replace

import pytest

from cluster.comparison.compare import Comparison
from cluster.config import CollectSettings, CompareSettings, Settings, TrainSettings
from cluster.demo import DemoSize, conclusion, demo, verdict
from cluster.errors import UserError
from cluster.runtime.session import Session
from cluster.tracking import open_tracker
from svaedc.analysis.aggregation import summarize
from svaedc.analysis.summary import Reporting, Row
from workers.randomness import Stream, generator

ALONE = Session("127.0.0.1:1", is_local=True, cpus=1)


def summary(f_of: dict[str, list[float]]):
    """A comparison whose runs each have one trial, with these objectives."""
    rows = [
        Row(method, run, 0, f, success=False) for method, all_f in f_of.items() for run, f in enumerate(all_f)
    ]
    return summarize(rows, Reporting(initial=0), generator(0, Stream.BOOTSTRAP, 0))


def difference(ours: list[float], theirs: list[float]):
    found = summary({"svae-dc": ours, "random": theirs}).differences
    return next(one for one in found if one.method == "svae-dc")


def test_a_difference_is_judged_by_pairs_not_by_overlapping_intervals():
    hard_and_easy = [-0.9, -0.3, 0.3, 0.9]
    said = verdict(difference([f + 0.05 for f in hard_and_easy], hard_and_easy))
    assert said.startswith("svae-dc against random: best objective +0.05 on average over 4 paired runs")
    assert "90 % bootstrap interval [+0.05, +0.05]; it excludes zero" in said


def test_a_difference_that_may_be_none_is_not_called_one():
    said = verdict(difference([0.1, -0.1, 0.2, -0.2], [0.0, 0.0, 0.0, 0.0]))
    assert "it includes zero: so few runs cannot tell the two apart" in said


def test_a_difference_against_ours_is_said_as_plainly():
    assert "-0.20 on average" in verdict(difference([0.1, 0.1, 0.1], [0.3, 0.3, 0.3]))


def test_one_run_and_no_run_in_common_tell_nothing():
    assert verdict(difference([0.5], [0.25])) == (
        "svae-dc against random: +0.25 at the end, in one run, which tells nothing about the next."
    )
    nothing = replace(difference([0.5], [0.25]), runs=0)
    assert verdict(nothing) == "svae-dc against random: no run in common."


@pytest.mark.parametrize("collapsed", ["", "the model collapsed: it ignores x"])
def test_the_end_names_every_result_and_repeats_a_collapse(tmp_path, collapsed):
    (tmp_path / "model").mkdir()
    (tmp_path / "model" / "metrics.json").write_text(json.dumps({"metrics": {}, "collapsed": collapsed}))
    methods = {"random": [0.0, 0.1], "screened-random": [0.0, 0.2], "se": [0.9, 0.9], "svae-dc": [0.3, 0.1]}
    said = conclusion(tmp_path, Comparison(summary(methods), "http://127.0.0.1:5000/#/some/run"), "svaedc ui")
    lines = said.splitlines()
    assert [line.partition(":")[0] for line in lines[:2]] == [
        "svae-dc against random",
        "svae-dc against screened-random",
    ]
    assert (f"Note, at this size: {collapsed}" in lines) == bool(collapsed)
    assert "Note" not in said or collapsed
    for place in ("comparison/figure.png", "comparison/trials.parquet", "dataset", "model/model.pt"):
        assert f" {tmp_path / place}" in said
    assert lines[-1].split() == [
        *("MLflow", "run", "http://127.0.0.1:5000/#/some/run", "(served", "by:", "svaedc", "ui)"),
    ]


@pytest.mark.parametrize(
    ("settings", "cpus"),
    [
        (Settings(compare=CompareSettings(slots=2)), 2),
        (Settings(compare=CompareSettings(slots=1), train=TrainSettings(workers=3)), 3),
        (Settings(compare=CompareSettings(slots=1), collect=CollectSettings(actors=4)), 4),
        (Settings(compare=CompareSettings(slots=2), train=TrainSettings(workers=3, least_workers=1)), 2),
    ],
)
def test_a_cluster_too_small_for_any_stage_is_refused_before_the_first(
    tmp_path, tracking_settings, settings, cpus
):
    with pytest.raises(UserError, match=f"this needs {cpus} CPUs"):
        demo(tmp_path / "demo", settings, ALONE, open_tracker(tracking_settings))
    assert not (tmp_path / "demo").exists()


@pytest.mark.slow
def test_a_gpu_that_training_will_miss_is_refused_before_the_first_stage(tmp_path, tracking_settings):
    settings = Settings(compare=CompareSettings(slots=1), train=TrainSettings(device="cuda"))
    with pytest.raises(UserError, match=r"train\.device=cuda asks for a GPU"):
        demo(tmp_path / "demo", settings, ALONE, open_tracker(tracking_settings))
    assert not (tmp_path / "demo").exists()


def test_a_size_that_a_stage_would_refuse_is_refused_at_once():
    with pytest.raises(ValueError, match="episodes must be at least 200, got 100"):
        DemoSize(episodes=100)
    with pytest.raises(ValueError, match="must be at least 1"):
        DemoSize(runs=0)
