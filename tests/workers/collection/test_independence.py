"""State that leaks from one episode into the next is found by another order."""

import pytest

from workers.attempts import Attempts
from workers.collection.independence import order_dependence
from workers.collection.recompute import rederive
from workers.collection.shard import collect_shard
from workers.dataset.folder import create
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.draws import Draws
from workers.rollout import draw

LEAKS = {
    "position": (
        "self.position, self.speed = 0.0, 0.0",
        "self.position, self.speed = getattr(self, 'position', 0.0), 0.0",
    ),
    "counter": (
        "force = command[0]",
        "self.steps = getattr(self, 'steps', 0) + 1\n        force = command[0] + 1e-3 * self.steps",
    ),
    "class": (
        "force = command[0]",
        "Glider.steps = getattr(Glider, 'steps', 0) + 1\n        force = command[0] + 1e-3 * Glider.steps",
    ),
    "random": ("force = command[0]", "force = command[0] + 1e-3 * np.random.default_rng().random()"),
}


def told(setup) -> str:
    with Attempts(setup) as attempts:
        episodes = attempts.rollouts(draw(setup, 0, index) for index in range(4))
    return order_dependence(setup, Draws(0), 0, episodes)


def test_a_sound_robot_has_nothing_to_tell(own_robot):
    assert told(own_robot()) == ""


@pytest.mark.parametrize("leak", LEAKS)
def test_a_leak_is_told_with_its_size_and_the_remedy(own_robot, leak):
    sentence = told(own_robot(LEAKS[leak], name=f"leaky_{leak}"))
    assert sentence.startswith(
        f"episode {0 if leak == 'random' else 3} is another one when it is rolled out in another order: "
        "ξ differs by up to "
    )
    assert "reset() must bring back everything" in sentence


def test_the_first_shard_of_a_collection_and_a_rederived_one_tell_it(own_robot, tmp_path):
    setup = own_robot(LEAKS["position"])
    dataset = create(tmp_path / "data", identity_of(setup, seed=0, episodes_per_shard=4))
    reports = [collect_shard(setup, dataset, shard) for shard in dataset.missing(8)]
    assert [bool(report.leak) for report in reports] == [True, False]
    for shard in dataset.shards():
        assert (
            "is another one when it is rolled out in another order" in rederive(setup, dataset, shard)[0].what
        )


def test_of_a_sound_robot_nothing_is_told(own_robot, tmp_path):
    setup = own_robot()
    dataset = create(tmp_path / "data", identity_of(setup, seed=0, episodes_per_shard=4))
    assert collect_shard(setup, dataset, Shard(0, 4)).leak == ""
    assert rederive(setup, dataset, Shard(0, 4)) == []
