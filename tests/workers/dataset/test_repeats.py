"""Datasets with several episodes of each controller: who shares what, and what no controller decides."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from workers import setups
from workers.dataset import schema, shards
from workers.dataset.cache import training_cache
from workers.dataset.folder import MANIFEST, create, open_dataset
from workers.dataset.identity import Identity, identity_of
from workers.dataset.repeats import Irreducible, error_bounds, irreducible, share
from workers.dataset.shards import Shard
from workers.dataset.verification import verify
from workers.rollout import random_episode


@pytest.fixture
def repeated(tmp_path, identity, fill):
    """Three episodes of each of 20 controllers; every seventh episode diverged."""
    created = create(tmp_path / "repeated", replace(identity, repeats=3))
    fill(created, 60)
    return created


def test_a_dataset_without_repeats_keeps_the_digest_of_the_first_version(identity, dataset):
    """The digest and the keys are those that the code wrote before datasets knew of repeats."""
    assert identity.digest == "24192f72ca69ad3c54ce4dd9914cc4d130cadb64fdb167adf3c93da98568b4ac"
    assert "repeats" not in (dataset.folder / MANIFEST).read_text()
    assert open_dataset(dataset.folder).identity.repeats == 1


def test_repeats_are_part_of_the_identity(repeated, identity):
    assert Identity.from_json(repeated.identity.to_json()) == repeated.identity
    with pytest.raises(ValueError, match="differ in repeats: 3 and 1"):
        create(repeated.folder, identity)
    with pytest.raises(ValueError, match="repeats must be at least 1, got 0"):
        replace(identity, repeats=0)


def test_consecutive_episodes_share_a_controller_and_nothing_else():
    setup = replace(setups.load("franka"), horizon=40)
    with setup.open() as environment:
        alone = [random_episode(setup, environment, 5, index) for index in range(6)]
        together = [random_episode(setup, environment, 5, index, repeats=3) for index in range(6)]
    for index, episode in enumerate(together):
        assert np.array_equal(episode.x, alone[index // 3].x)
        assert episode.physics == alone[index].physics
    assert together[0].xi.tobytes() == alone[0].xi.tobytes()
    assert len({episode.xi.tobytes() for episode in together}) == 6


def test_verification_knows_which_controllers_are_repeated(repeated, identity, episodes_of):
    assert [found for _, found in verify(repeated)] == [[]] * len(repeated.shards())
    single = episodes_of(identity, range(60, 64))
    shards.commit(
        repeated.folder, Shard(60, 64), lambda path: schema.write(path, repeated.identity, 60, single)
    )
    problems = [problem.what for _, found in verify(repeated) for problem in found]
    assert problems == ["its controllers are not those of seed 5"]


@pytest.mark.parametrize("repeats", [1, 2, 3, 7])
def test_no_controller_is_on_both_sides_of_the_training_split(tmp_path, identity, fill, repeats):
    dataset = create(tmp_path / "dataset", replace(identity, repeats=repeats))
    fill(dataset, 30 * repeats)
    cache = training_cache(dataset, 5, tmp_path / "cache")
    held_out, training = cache.held_out(), cache.training()
    assert sorted([*held_out, *training]) == list(range(len(cache.episode)))
    assert not {x.tobytes() for x in cache.x[held_out]} & {x.tobytes() for x in cache.x[training]}
    assert set((cache.episode[held_out] // repeats).tolist()) <= {9, 19, 29}


def test_the_share_of_variance_is_that_of_all_pairs_counted_one_by_one():
    values = np.random.default_rng(0).normal(size=(7, 1)) + np.random.default_rng(1).normal(size=(7, 3))
    episodes = [(controller, value) for controller, row in enumerate(values) for value in row]
    pairs = list(combinations(episodes, 2))
    same = np.mean([(a - b) ** 2 for (i, a), (j, b) in pairs if i == j])
    other = np.mean([(a - b) ** 2 for (i, a), (j, b) in pairs if i != j])
    assert share(values) == pytest.approx(same / other)


def test_the_share_of_variance_finds_the_noise_that_was_added():
    rng = np.random.default_rng(2)
    values = rng.normal(scale=2.0, size=(4000, 1)) + rng.normal(size=(4000, 2))
    assert share(values) == pytest.approx(1 / 5, abs=0.02)
    assert share(np.repeat(values[:, :1], 2, axis=1)) == 0.0
    assert np.isnan(share(np.ones((3, 2))))


def test_the_bounds_of_the_error_enclose_that_of_the_true_median():
    """Laplace noise of scale 1 around trajectories that are known here."""
    rng = np.random.default_rng(3)
    truth = rng.normal(scale=3.0, size=(300, 1, 2, 8))
    xi = (truth + rng.laplace(size=(300, 4, 2, 8))).astype(np.float32)
    spread = np.abs(xi - np.median(xi, axis=(0, 1))).mean(axis=(0, 1, 3))
    best = (np.abs(xi - truth).mean(axis=(0, 1, 3)) / spread).mean()
    low, high = error_bounds(xi)
    assert low < best < high < 1.3 * best


def test_repeats_that_are_equal_leave_no_error_and_still_channels_count_for_nothing():
    moving = np.random.default_rng(4).normal(size=(9, 1, 1, 5)).astype(np.float32)
    xi = np.concatenate([np.repeat(moving, 3, axis=1), np.ones((9, 3, 1, 5), np.float32)], axis=2)
    assert error_bounds(xi) == (0.0, 0.0)
    assert np.isnan(error_bounds(np.ones((2, 2, 1, 5), np.float32))).all()


def test_the_irreducible_part_of_a_dataset_counts_whole_controllers_only(repeated):
    """Of 20 controllers, those of the episodes 3, 10, 17, ... lack a repeat."""
    columns = [columns for _, columns in repeated.batches()]
    whole = [c for c in range(20) if not any(index % 7 == 3 for index in range(3 * c, 3 * c + 3))]
    rows = np.array([[3 * c + r for r in range(3)] for c in whole])
    found = irreducible(repeated)
    assert found.controllers == len(whole) == 11
    for name in ("y", "f"):
        values = np.concatenate([getattr(part, name) for part in columns]).astype(np.float64)
        assert getattr(found, name) == pytest.approx(share(values[rows]))
    assert found.xi == pytest.approx(error_bounds(np.concatenate([part.xi for part in columns])[rows]))


def test_stopped_repeats_are_facts_about_their_controller(tmp_path, identity, stopped_of):
    """Of 10 controllers with two episodes, those of the diverged episodes 3, 10 and 17 lack one."""
    dataset = create(
        tmp_path / "dataset", replace(identity, repeats=2, conditions=(*identity.conditions, "stopped"))
    )
    rows = stopped_of(dataset.identity, range(20))
    shards.commit(dataset.folder, Shard(0, 20), lambda path: schema.write(path, dataset.identity, 0, rows))
    assert irreducible(dataset).controllers == 7


def test_an_irreducible_part_needs_repeats_and_two_whole_controllers(dataset, tmp_path, identity, fill):
    with pytest.raises(ValueError, match="must hold repeats of its controllers, got repeats = 1"):
        irreducible(dataset)
    few = create(tmp_path / "few", replace(identity, repeats=3))
    assert irreducible(few) is None
    fill(few, 5)
    assert irreducible(few) is None


def test_a_setups_identity_takes_the_repeats_asked_for():
    identity = identity_of(setups.load("franka"), seed=1, episodes_per_shard=256, repeats=4)
    assert identity.repeats == 4
    assert '"repeats":4' in identity.to_json()


@pytest.mark.parametrize(("y", "f", "count"), [(0.2, 0.5, 0), (0.6, 0.1, 1), (0.1, 0.6, 1), (np.nan, 0.6, 1)])
def test_more_than_half_that_no_controller_decides_is_told_with_the_remedy(y, f, count):
    notes = Irreducible(controllers=9, y=y, f=f, xi=(0.1, 0.2)).notes
    assert len(notes) == count
    assert all("narrow the ranges of physics" in note for note in notes)
