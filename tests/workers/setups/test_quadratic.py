"""The analytic setups of appendix C against the formulas as the paper prints them."""

import numpy as np
import pytest

from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.cache import training_cache
from workers.dataset.folder import create
from workers.dataset.identity import identity_of
from workers.dataset.statistics import statistics
from workers.dataset.verification import verify
from workers.rollout import random_episode, rollout
from workers.tasks.quadratic import Quadratic

PRINTED = {
    "quadratic-30d": lambda x: sum((x_i + 1) ** 2 for x_i in x),
    "quadratic-30d-intrinsic-3": lambda x: sum((x_i + 1) ** 2 for x_i in x[:3]) + 0.001 * sum(x[3:]),
}


@pytest.fixture(params=sorted(PRINTED))
def setup(request):
    return setups.load(request.param)


def test_the_objective_is_the_printed_formula(setup):
    with setup.open() as environment:
        episodes = [random_episode(setup, environment, 0, index) for index in range(20)]
    for episode in episodes:
        expected = PRINTED[setup.name]([float(x_i) for x_i in episode.x])
        assert episode.f == pytest.approx(expected, rel=1e-6)
        assert np.array_equal(episode.xi[:, -1], episode.x)
        assert episode.y == 0.0
        assert episode.stop == ""


@pytest.mark.parametrize(("corner", "bound"), [(0.0, 0), (1.0, 1)])
def test_the_limits_are_reached_at_two_corners(setup, corner, bound):
    with setup.open() as environment:
        episode = rollout(setup, environment, np.full(30, corner), {})
    assert episode.f == np.float32(setup.objective_limits[bound])


def test_success_is_a_twentieth_of_the_range_below_the_optimum(setup):
    low, high = setup.objective_limits
    assert setup.success == pytest.approx(high - 0.05 * (high - low))


def test_27_of_30_dimensions_hardly_matter():
    setup = setups.load("quadratic-30d-intrinsic-3")
    indifferent = np.concatenate([np.ones(3), np.zeros(27)])
    with setup.open() as environment:
        assert rollout(setup, environment, indifferent, {}).f == 12.0


def test_a_dataset_without_physics_is_whole_and_can_be_trained_on(setup, tmp_path):
    dataset = create(tmp_path / "dataset", identity_of(setup, seed=1, episodes_per_shard=16))
    for shard in dataset.missing(40):
        collect_shard(setup, dataset, shard)
    assert [found for _, found in verify(dataset)] == [[], [], []]
    assert statistics(dataset).badness == 0.0
    cache = training_cache(dataset, 1, tmp_path)
    assert cache.xi.shape == (40, 30, 2)
    assert np.array_equal(cache.xi[:, :, -1], cache.x)


@pytest.mark.parametrize("intrinsic", [0, 31])
def test_more_or_fewer_dimensions_that_matter_than_there_are_are_refused(intrinsic):
    with pytest.raises(ValueError, match=f"between 1 and dimensions 30, got {intrinsic}"):
        Quadratic(30, intrinsic)
