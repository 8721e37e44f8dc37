"""Candidates are simulated in shared worlds, encoded, and written as one table; nothing is done twice."""

import numpy as np
import pytest

from cluster.candidates.simulate import simulate, summarise
from cluster.optimization.candidates import TABLE, read
from cluster.tracking import open_tracker
from svaedc.bo.simulated.encoding import latent_paths
from svaedc.model import checkpoint
from tests.cluster.candidates.conftest import FRANKA, SETTINGS, roll_out, untrained_model
from workers import setups
from workers.dataset.folder import open_dataset
from workers.dataset.shards import sha256
from workers.dataset.verification import verify


def test_the_table_holds_what_the_episodes_beside_it_showed(candidates, untrained):
    table, dataset = read(candidates / TABLE), open_dataset(candidates / "franka")
    assert not [problem for _, problems in verify(dataset) for problem in problems]
    assert (table.x.shape, table.f.shape, table.bad.shape) == (
        (10, 48),
        (10, 2),
        (10, 2, len(FRANKA.conditions)),
    )
    episode = dataset.episode(13)  # the second of candidate 6
    assert np.array_equal(table.x[6], episode.x)
    assert (table.f[6, 1], table.y[6, 1]) == (episode.f, np.float32(episode.y))
    file = untrained / checkpoint.FILE
    model, _ = checkpoint.load(file)
    seen = (episode.xi[None, :, 4::5], (episode.bad[None, 4::5] != 0).astype(np.float32))
    tau = latent_paths(model, *seen, np.array([episode.y], np.float32))
    np.testing.assert_allclose(table.tau[sha256(file)][6, 1], tau[0], rtol=1e-4, atol=1e-5)
    assert len(table.drawn) == 8


def test_a_cluster_simulates_the_same_candidates_and_a_second_time_nothing(
    candidates, planned, untrained, ray_session, tracking_settings, tmp_path, capsys
):
    plan = planned(tmp_path / "c", models=[untrained])
    simulate(plan, SETTINGS, ray_session, open_tracker(tracking_settings))
    one, other = read(candidates / TABLE), read(tmp_path / "c" / TABLE)
    assert one.origin == other.origin
    for name in ("x", "f", "y", "bad"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert_equal_latents(one.tau, other.tau)
    assert "10 candidates in 2 worlds of franka; the best has" in capsys.readouterr().err
    again = planned(tmp_path / "c", models=[untrained])
    assert again.is_whole
    assert not any(collection.missing for collection in again.collections)


def assert_equal_latents(one, other):
    assert one.keys() == other.keys()
    assert all(np.array_equal(one[model], other[model]) for model in one)


def test_other_models_or_several_encode_the_episodes_that_are_there(candidates, planned, untrained, tmp_path):
    plain = planned(tmp_path / "c")
    roll_out(plain)
    table = summarise(plain)
    assert table.tau == read(plain.table).tau == {}
    assert np.array_equal(table.f, read(candidates / TABLE).f)
    other = untrained_model(tmp_path / "other", seed=1)
    both = planned(tmp_path / "c", models=[other, untrained])
    assert not both.is_whole
    assert not any(collection.missing for collection in both.collections)
    tau = summarise(both).tau
    assert_equal_latents(tau, read(both.table).tau)
    assert [*tau] == [sha256(folder / checkpoint.FILE) for folder in (other, untrained)]
    assert np.array_equal([*tau.values()][1], *read(candidates / TABLE).tau.values())
    assert planned(tmp_path / "c", models=[untrained, other]).is_whole


@pytest.mark.slow
def test_two_engines_make_twice_as_many_worlds(planned, tmp_path):
    plan = planned(tmp_path / "c", setups=[FRANKA, setups.load("franka-mujoco")])
    roll_out(plan)
    table = summarise(plan)
    assert table.f.shape == (10, 4)
    assert not np.array_equal(table.f[:, :2], table.f[:, 2:])
