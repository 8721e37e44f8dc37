"""Reproducing a figure: its plan, its bill, its table, and a whole one that is interrupted."""

import json
import math
import shutil
from dataclasses import replace

import numpy as np
import pytest
import torch

from cluster.comparison.records import RunKey, append
from cluster.config import CompareSettings, Settings, TrainSettings
from cluster.errors import UserError
from cluster.reproduction.cost import bill, lines
from cluster.reproduction.experiment import Panel, Recipe
from cluster.reproduction.figures import RECIPES
from cluster.reproduction.plan import SCALES, resolve
from cluster.reproduction.report import publish, table
from cluster.reproduction.run import reproduce
from cluster.runtime.session import Session
from cluster.tracking import open_tracker
from svaedc.analysis.aggregation import summarize
from svaedc.analysis.evidence import Claim, Successes
from svaedc.analysis.paired_evidence import Gain
from svaedc.analysis.summary import Reporting, Row
from svaedc.bo.loop import Trial
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc
from svaedc.training.presets import Sizes, compact, vary
from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import create
from workers.dataset.identity import identity_of

MACHINE = SCALES["machine"]
TINY = Recipe(
    "figure-0",
    "a walk",
    data="franka",
    runs=2,
    panels=(Panel("push", "a push", "franka-rehearsal", ("random", "svae-dc"), trials=2, gap="wide"),),
    claims=(
        Claim("better", "section 0", (Gain("push", "svae-dc", "random", 2),)),
        Claim("often", "section 0", (Successes("push", "svae-dc", "runs", 0.0, 1.0),)),
    ),
)


@pytest.fixture(scope="module")
def few_episodes(tmp_path_factory):
    """A real dataset of eight episodes, rolled out in this process."""
    setup = setups.load("franka")
    dataset = create(
        tmp_path_factory.mktemp("few") / "dataset", identity_of(setup, seed=0, episodes_per_shard=256)
    )
    for shard in dataset.missing(8):
        collect_shard(setup, dataset, shard)
    return dataset.folder


def plan_of(recipe, folder, dataset=None, models=(), episodes=300, runs=2):
    return resolve(
        recipe, MACHINE, folder, episodes=episodes, runs=runs, dataset=dataset, models=tuple(models)
    )


def untrained(folder, setup="franka", latent="3x3"):
    torch.manual_seed(0)
    folder.mkdir()
    model = SvaeDc(vary(compact(Sizes(48, 25, 100)), {"latent": latent}).model)
    checkpoint.save(folder / "model.pt", model, {"setup": setup})
    return folder


def costs(reproduction, settings=Settings()):  # noqa: B008 - settings never change
    return {item.step.split(":")[0]: item.cost for item in bill(reproduction, settings, 2)}


def test_figures_of_one_robot_share_its_data_and_model(tmp_path):
    hardware, simulation = (plan_of(RECIPES[figure], tmp_path) for figure in ("figure-7", "figure-8"))
    assert hardware.dataset == simulation.dataset == tmp_path / "data" / "yumi-300"
    assert hardware.models == simulation.models
    assert hardware.results != simulation.results


def test_a_given_model_spares_data_and_training_and_the_other_size_is_still_trained(tmp_path):
    model = untrained(tmp_path / "given")
    push = plan_of(TINY, tmp_path, models=[model])
    assert (push.collects, push.trains, push.models) == (False, (), {"3x3": model})
    assert all(cost.seconds == 0 for step, cost in costs(push).items() if step.startswith("train"))
    both = plan_of(RECIPES["figure-9"], tmp_path, models=[model])
    assert (both.collects, both.trains) == (True, ("5x6",))
    other = untrained(tmp_path / "larger", latent="5x6")
    assert plan_of(RECIPES["figure-9"], tmp_path, models=[other, model]).trains == ()


def test_models_and_datasets_that_do_not_fit_are_refused_with_the_remedy(tmp_path, few_episodes):
    with pytest.raises(UserError, match="made for setup 'yumi', not 'franka'"):
        plan_of(TINY, tmp_path, models=[untrained(tmp_path / "yumi", setup="yumi")])
    model = untrained(tmp_path / "franka")
    with pytest.raises(UserError, match="figure-0 takes one model of each of: 3x3"):
        plan_of(TINY, tmp_path, models=[model, model])
    with pytest.raises(UserError, match="cannot use the model"):
        plan_of(TINY, tmp_path, models=[tmp_path / "nowhere"])
    with pytest.raises(UserError, match="cannot use the dataset"):
        plan_of(TINY, tmp_path, dataset=tmp_path / "nowhere")
    with pytest.raises(UserError, match="holds episodes of 'franka', this figure needs 'yumi'"):
        plan_of(RECIPES["figure-8"], tmp_path, dataset=few_episodes)


def test_a_given_dataset_is_used_as_it_is(tmp_path, few_episodes):
    given = plan_of(TINY, tmp_path, dataset=few_episodes)
    assert (given.episodes, given.collects, given.dataset) == (8, False, few_episodes)
    assert given.missing_episodes() == 0


def test_a_damaged_dataset_in_the_way_is_refused_before_its_bill(tmp_path):
    push = plan_of(TINY, tmp_path)
    push.dataset.mkdir(parents=True)
    (push.dataset / "dataset.json").write_text("{")
    with pytest.raises(UserError, match="cannot use the dataset"):
        costs(push)


def test_the_bill_is_the_sum_of_single_costs_and_shrinks_by_what_is_there(tmp_path, few_episodes):
    whole = plan_of(TINY, tmp_path)
    items = costs(whole)
    # 300 episodes of 27 ms on two cores, 4,000 updates of 37 ms on one.
    assert items["collect 300 of 300 episodes of franka"].core_seconds == pytest.approx(300 * 0.027)
    assert items["collect 300 of 300 episodes of franka"].seconds == pytest.approx(300 * 0.027 / 2)
    assert items["train 3x3"].seconds == pytest.approx(4000 * 0.037)
    shutil.copytree(few_episodes, whole.dataset)
    for index in range(2):
        trial = Trial(index, np.zeros(48, np.float32), 0.1, 0.0, 0.1, False, "ok", 0.1, "")
        (whole.comparison(TINY.panels[0]) / "runs").mkdir(parents=True, exist_ok=True)
        append(RunKey("random", 0).path(whole.comparison(TINY.panels[0])), trial)
    said = "\n".join(lines(whole, bill(whole, Settings(), 2), 2))
    assert "collect 292 of 300 episodes of franka" in said
    # Four runs of four trials, of which one is half done.
    assert sum(item.cost.size for item in bill(whole, Settings(), 2)[2:]) == 3.5 * 4 * 400
    assert "in all" in said


def test_the_scales_preset_decides_stride_and_updates_unless_a_setting_does(tmp_path):
    paper = replace(plan_of(TINY, tmp_path), scale=SCALES["paper"])
    numbers = 4 * paper.episodes * 25  # bytes of one sample of all episodes: 25 channels of float32
    assert paper.cache_size(TrainSettings()) == 500 * numbers
    assert paper.cache_size(TrainSettings(stride=4)) == 125 * numbers
    assert plan_of(TINY, tmp_path).cache_size(TrainSettings()) == 100 * numbers
    assert paper.training(TrainSettings(), "5x6").changes() == {"latent": "5x6"}
    assert paper.training(TrainSettings(), "3x3").changes() == {}
    assert paper.updates(TrainSettings()) == 100_000
    assert paper.updates(TrainSettings(updates=7)) == 7


def compared(ends: dict[str, list[float]]):
    rows = [
        Row(method, run, trial, end, success=end > 0.4)
        for method, all_f in ends.items()
        for run, end in enumerate(all_f)
        for trial in range(4)
    ]
    return summarize(rows, Reporting(), np.random.default_rng(0))


def test_the_table_holds_numbers_against_claims_and_calls_a_stand_in_one(tmp_path):
    found = table(TINY, {"push": compared({"random": [0.0, 0.1, 0.2], "svae-dc": [0.5, 0.5, 0.5]})}, 2)
    text, data = publish(made(tmp_path), found)
    page, content = text.read_text(), json.loads(data.read_text())
    assert page.startswith("# figure-0: a walk (simulated stand-in)\n")
    assert "*a push (simulated stand-in); all numbers in" in page
    assert "| better | section 0 | svae-dc − random, best after 2 | +0.400 [" in page
    assert page.count("| holds |") == 2
    assert content["title"] == "a walk (simulated stand-in)"
    assert content["stand_in"] is True
    assert content["episodes"] == 300
    assert [claim["verdict"] for claim in content["claims"]] == ["holds", "holds"]
    assert content["claims"][0]["mean"] == pytest.approx(0.4)


def test_what_was_not_compared_is_said_to_be_not_measured(tmp_path):
    found = table(TINY, {}, 2)
    assert [entry.finding.verdict for entry in found.entries] == ["not measured"] * 2
    assert math.isnan(found.entries[0].finding.value.mean)
    _, data = publish(made(tmp_path), found)
    assert json.loads(data.read_text())["claims"][0]["mean"] is None


def made(folder):
    """A reproduction whose folder exists."""
    reproduction = plan_of(TINY, folder)
    reproduction.results.mkdir(parents=True)
    return reproduction


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
