"""Controllers that were chosen lie beside the manifest, which names their bytes."""

from dataclasses import replace

import numpy as np
import pytest

from workers import setups
from workers.collection.recompute import rederive
from workers.collection.shard import collect_shard, require_same_code
from workers.dataset.chosen import CHOSEN, chosen_digest, read_chosen
from workers.dataset.folder import create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.dataset.verification import verify
from workers.draws import REPEAT

CONTROLLERS = np.random.default_rng(0).random((2, 48), dtype=np.float32)
SETUP = setups.load("franka").under("wide")


def identity(**changes):
    asked = {"gap": "wide", "repeats": 2, "physics_of": REPEAT, "chosen": chosen_digest(CONTROLLERS)}
    return identity_of(SETUP, seed=3, episodes_per_shard=4, **{**asked, **changes})


def test_a_dataset_of_chosen_controllers_under_another_gap_is_whole_and_rolls_out_again(tmp_path):
    dataset = create(tmp_path / "d", identity(), CONTROLLERS)
    collect_shard(SETUP, dataset, Shard(0, 4))
    collect_shard(SETUP, dataset, Shard(4, 6))
    again = open_dataset(tmp_path / "d")
    assert not [problem for _, problems in verify(again) for problem in problems]
    assert not rederive(SETUP, again, Shard(4, 6))
    columns = again.read(Shard(0, 4))
    assert np.array_equal(columns.x, np.repeat(CONTROLLERS, 2, axis=0))
    for values in columns.physics.values():
        assert values[0] == values[2] != values[1]
    assert dataset.identity.physics == dict(setups.load("franka").gaps["wide"].intervals)


def test_rollouts_of_the_setup_as_it_is_are_refused_for_a_dataset_of_a_gap(tmp_path):
    dataset = create(tmp_path / "d", identity(), CONTROLLERS)
    require_same_code(SETUP, dataset)
    with pytest.raises(ValueError, match="physics"):
        require_same_code(setups.load("franka"), dataset)


@pytest.mark.parametrize(("spoil", "found"), [("missing", "is missing"), ("changed", "has changed")])
def test_a_file_of_controllers_that_is_not_the_one_is_refused_by_name(tmp_path, spoil, found):
    dataset = create(tmp_path / "d", identity(), CONTROLLERS)
    path = tmp_path / "d" / CHOSEN
    if spoil == "missing":
        path.unlink()
    else:
        path.write_bytes(path.read_bytes()[:-1] + b"\0")
    with pytest.raises(ValueError, match=rf"{CHOSEN} {found}: the first controllers"):
        dataset.draws()
    with pytest.raises(ValueError, match=found):
        read_chosen(tmp_path / "d", dataset.identity.chosen)


def test_other_controllers_make_another_dataset(tmp_path):
    create(tmp_path / "d", identity(), CONTROLLERS)
    other = np.flip(CONTROLLERS, axis=0).copy()
    with pytest.raises(ValueError, match="differ in chosen"):
        create(tmp_path / "d", identity(chosen=chosen_digest(other)), other)
    assert np.array_equal(open_dataset(tmp_path / "d").draws().chosen, CONTROLLERS)


def test_choices_that_nobody_makes_leave_the_identity_of_a_dataset_as_it_was():
    plain = identity_of(setups.load("franka"), seed=3, episodes_per_shard=4)
    assert not {"gap", "physics_of", "chosen"} & set(plain.to_json().split('"'))
    with pytest.raises(ValueError, match="physics_of must be one of episode, repeat, got 'world'"):
        replace(plain, physics_of="world")
