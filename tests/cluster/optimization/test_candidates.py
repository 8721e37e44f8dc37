"""A table of candidates is read back as it was written, and refused where it does not belong."""

import numpy as np
import pytest

from cluster.errors import UserError
from cluster.optimization.candidates import TABLE, read, require_usable, write
from cluster.optimization.factory import Optimization
from tests.cluster.optimization.tables import FRANKA, table
from workers import setups
from workers.dataset.shards import sha256
from workers.rollout import VERSION


def test_what_is_written_is_read_again(tmp_path):
    one = table()
    write(tmp_path / TABLE, one)
    other = read(tmp_path / TABLE)
    for name in ("x", "f", "y", "bad"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert np.array_equal(one.tau["0" * 64], other.tau["0" * 64])
    assert other.origin == one.origin


def test_a_table_that_is_missing_or_damaged_is_told_with_the_command_that_makes_it(tmp_path):
    with pytest.raises(UserError, match=r"no candidates in .*svaedc candidates --out"):
        read(tmp_path / TABLE)
    write(tmp_path / TABLE, table())
    content = (tmp_path / TABLE).read_bytes()
    (tmp_path / TABLE).write_bytes(content[: len(content) // 2])
    with pytest.raises(UserError, match="is damaged, or no table of candidates"):
        read(tmp_path / TABLE)


@pytest.mark.parametrize(
    ("changes", "setup", "named"),
    [
        ({}, "yumi", "whose parameters are not those of yumi"),
        ({}, "daisy-27d", "have 48 parameters, daisy-27d has 27"),
        ({"rollout_version": VERSION + 1}, "franka", f"by version {VERSION + 1} of the simulation"),
        ({}, "franka", "latent paths of .* are of another model"),
        ({"setup_digests": ["0" * 64]}, "franka", "has changed since the candidates of"),
        ({"chosen": 29}, "franka", "must hold 2 that were drawn.*got 1: simulate more"),
    ],
)
def test_candidates_of_another_robot_version_or_model_are_refused(tmp_path, changes, setup, named):
    write(tmp_path / TABLE, table(**changes))
    model = tmp_path / "model.pt"
    model.write_bytes(b"weights")
    with pytest.raises(UserError, match=named):
        require_usable(tmp_path / TABLE, setups.load(setup), [model], 2)
    for encoders, asked in (({sha256(model): 4}, [model]), ({}, [model]), ({"0" * 64: 4}, [])):
        write(tmp_path / TABLE, table(models=encoders))
        require_usable(tmp_path / TABLE, FRANKA, asked, 2)


def test_a_run_begins_with_drawn_candidates_and_chooses_among_all_of_them():
    candidates = table()
    run = Optimization(FRANKA, "simulated-best", 3, 100, candidates=candidates)
    first = np.stack([run.initial(index) for index in range(25)])
    assert len(np.unique(first, axis=0)) == 25
    assert {row.tobytes() for row in first} == {row.tobytes() for row in candidates.x[5:]}
    assert np.array_equal(run.problem().pool, candidates.x)
    assert run.problem().latents is None


def test_of_more_candidates_than_a_pool_holds_each_seed_draws_its_own():
    candidates = table()
    pools = [Optimization(FRANKA, "se", seed, 10, candidates=candidates).problem().pool for seed in (1, 1, 2)]
    assert np.array_equal(pools[0], pools[1])
    assert not np.array_equal(pools[0], pools[2])
    assert {row.tobytes() for row in pools[0]} < {row.tobytes() for row in candidates.x}


def test_simulated_features_take_the_place_of_learnt_ones():
    candidates = table()
    latents = candidates.latents(candidates.x[:7], "0" * 64)
    np.testing.assert_allclose(latents.tau.numpy(), candidates.tau["0" * 64][:7].mean(axis=1))
    assert candidates.latents(candidates.x[:7], "1" * 64) is None
    np.testing.assert_allclose(latents.y.numpy(), candidates.y[:7].mean(axis=1))
