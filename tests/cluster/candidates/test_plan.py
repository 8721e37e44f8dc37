"""Which candidates are simulated, and what is refused before anything is."""

import numpy as np
import pytest

from cluster.candidates.plan import choose
from cluster.errors import UsageError, UserError
from tests.cluster.candidates.conftest import FRANKA
from workers import setups
from workers.collection.choice import Keep
from workers.dataset.folder import open_dataset


def test_half_may_be_the_best_or_the_least_bad_of_a_dataset(candidates):
    place = candidates / "franka"
    dataset = open_dataset(place)
    columns = [dataset.read(shard) for shard in dataset.shards()]
    f, y, x = (np.concatenate([getattr(part, name) for part in columns]) for name in ("f", "y", "x"))
    f, y, x = f.reshape(-1, 2).mean(axis=1), y.reshape(-1, 2).mean(axis=1), x[::2]
    assert np.array_equal(choose(place, FRANKA, Keep.BEST, 3), x[np.argsort(-f, kind="stable")[:3]])
    assert np.array_equal(choose(place, FRANKA, Keep.LEAST_BAD, 3), x[np.argsort(y, kind="stable")[:3]])
    assert len(choose(place, FRANKA, Keep.BEST, 99)) == 10


def test_a_dataset_of_another_robot_or_none_is_refused_by_name(candidates, tmp_path):
    with pytest.raises(UserError, match=r"controllers of .* are not those of yumi"):
        choose(candidates / "franka", setups.load("yumi"), Keep.BEST, 3)
    with pytest.raises(UserError, match=r"cannot choose among the controllers of .* holds no dataset"):
        choose(tmp_path, FRANKA, Keep.BEST, 3)


def test_other_candidates_in_the_folder_are_refused_naming_the_difference(candidates, planned, untrained):
    for changes, named in (
        ({"seed": 2}, "seed: 1 and 2"),
        ({"gap": "paper"}, "gap"),
        ({"episodes": 3}, "repeats"),
    ):
        with pytest.raises(UserError, match=f"another dataset.*{named}"):
            planned(candidates, models=[untrained], **changes)


def test_setups_of_different_robots_and_more_chosen_than_asked_for_are_refused(planned, tmp_path):
    with pytest.raises(UsageError, match="cannot run the same controllers"):
        planned(tmp_path / "c", setups=[FRANKA, setups.load("yumi")])
    with pytest.raises(UsageError, match="at least the 2 controllers that are chosen, got 1"):
        planned(tmp_path / "c", count=1)
    with pytest.raises(UsageError, match="unknown gap level 'narrow'"):
        planned(tmp_path / "c", gap="narrow")


def test_the_plan_says_which_worlds_all_candidates_share(planned, tmp_path):
    plan = planned(tmp_path / "c", setups=[FRANKA, setups.load("franka-mujoco")])
    first, second, third, _ = plan.origin["worlds"]
    assert [world["setup"] for world in plan.origin["worlds"]] == ["franka"] * 2 + ["franka-mujoco"] * 2
    assert first != second
    assert {**first, "setup": "franka-mujoco"} == third
    assert not plan.is_whole
