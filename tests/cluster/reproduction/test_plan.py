"""What a reproduction will do: shared data and models, given ones, and what does not fit."""

from dataclasses import replace

import pytest

from cluster.config import TrainSettings
from cluster.errors import UserError
from cluster.reproduction.paper_figures import RECIPES
from cluster.reproduction.plan import SCALES
from cluster.reproduction.recipe import Training
from tests.cluster.reproduction.tiny import TINY, costs, plan_of, untrained


def test_figures_of_one_robot_share_its_data_and_model(tmp_path):
    hardware, simulation = (plan_of(RECIPES[figure], tmp_path) for figure in ("figure-7", "figure-8"))
    assert hardware.dataset == simulation.dataset == tmp_path / "data" / "yumi-300"
    assert hardware.models == simulation.models
    assert hardware.results != simulation.results


def test_a_given_model_spares_data_and_training_and_the_other_size_is_still_trained(tmp_path):
    model = untrained(tmp_path / "given")
    push = plan_of(TINY, tmp_path, models=[model])
    assert (push.collects, push.trains, push.models) == (False, (), {Training("3x3"): model})
    assert all(cost.seconds == 0 for step, cost in costs(push).items() if step.startswith("train"))
    both = plan_of(RECIPES["figure-9"], tmp_path, models=[model])
    assert (both.collects, both.trains) == (True, (Training("5x6"),))
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
