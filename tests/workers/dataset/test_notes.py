"""What is odd about a dataset, told before a model is trained on it."""

import pytest

from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import create
from workers.dataset.identity import identity_of
from workers.dataset.notes import notes


@pytest.fixture
def noted(own_robot, tmp_path):
    """Notes of 40 episodes of the robot, with a mistake planted."""

    def collect(*changes: tuple[str, str]) -> list[str]:
        setup = own_robot(*changes)
        dataset = create(tmp_path / "data", identity_of(setup, seed=0, episodes_per_shard=16))
        for shard in dataset.missing(40):
            collect_shard(setup, dataset, shard)
        return notes(dataset)

    return collect


def test_of_a_sound_robot_nothing_is_noted(noted):
    assert noted() == []


@pytest.mark.parametrize(
    ("change", "note"),
    [
        (
            ('"m/s", -5.0, 5.0', '"m/s", -5e6, 5e6'),
            "e-07 of its bounds [-5e+06, 5e+06] m/s: it looks constant to a model",
        ),
        (('"m/s", -5.0, 5.0', '"m/s", -5.0, 1e-9'), "% of the episodes diverged, and no model sees those"),
        (('"m", -5.0, 5.0', '"m", 4.0, 5.0'), "every episode diverged, so there is nothing to learn from"),
        (
            ("force = command[0]", "force = command"),
            "every episode failed, so there is nothing to learn from",
        ),
        (("return float(observed.xi[0, -1])", "return 1.0"), "the objective is 1 in every episode"),
        (("> 0.5", "> 4.5"), "badness y is 0 in every episode"),
        (("> 0.5", "> -0.5"), "badness y is 1 in every episode"),
    ],
)
def test_what_makes_a_dataset_useless_is_noted_with_a_remedy(noted, change, note):
    assert [note in told for told in noted(change)].count(True) == 1


def test_nothing_is_noted_of_no_episodes(tmp_path):
    setup = setups.load("franka")
    assert notes(create(tmp_path / "data", identity_of(setup, seed=0, episodes_per_shard=16))) == []
