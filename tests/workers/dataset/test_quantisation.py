"""What int16 storage loses is bounded, and everything else stays as it was."""

import json
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workers import setups
from workers.collection.recompute import rederive
from workers.collection.shard import collect_shard, roll_out
from workers.dataset.folder import create
from workers.dataset.identity import Identity, identity_of
from workers.dataset.quantisation import decode, encode, error_bound
from workers.dataset.verification import verify


@pytest.fixture
def coded(identity):
    """The toy identity with its trajectories as int16."""
    return replace(identity, storage="int16")


def channel(low: float, high: float, identity: Identity) -> Identity:
    return replace(identity, observation=(("q", "rad", low, high),))


@given(data=st.data(), low=st.floats(-20, 19), width=st.floats(0.01, 40))
def test_a_value_within_its_bounds_is_restored_within_the_stated_error(data, low, width):
    identity = channel(low, low + width, TOY)
    inside = st.floats(np.float32(low), np.float32(low + width), width=32)
    values = np.array([[data.draw(inside) for _ in range(5)]], dtype=np.float32)
    kept = np.clip(values, low, low + width)
    again = decode(encode(values, identity), identity)
    assert np.abs(again.astype(np.float64) - kept).max() <= error_bound(identity)[0]


TOY = Identity(
    setup="toy",
    parameters=(("stiffness", 0.0, 1.0),),
    observation=(("q", "rad", -1.0, 1.0),),
    conditions=("tipped",),
    horizon=5,
    control_step=0.002,
    physics={"mass": (1.9, 2.1)},
    seed=5,
    episodes_per_shard=8,
    schema_version=1,
    rollout_version=1,
    pybullet="3",
    numpy="2",
    storage="int16",
)


def test_every_code_is_restored_to_a_value_with_that_code():
    codes = np.arange(-(2**15), 2**15, dtype=np.int16)[None, :]
    values = decode(codes, TOY)
    np.testing.assert_array_equal(encode(values, TOY), codes)
    assert values[0, [0, -1]].tolist() == [-1.0, 1.0]


def test_the_error_of_the_bound_is_reached_between_two_codes():
    """The bound is no larger than it must be."""
    step = 2.0 / 65535
    values = np.array([[-1.0 + 1000.5 * step, 0.5 * step]], dtype=np.float32)
    error = np.abs(decode(encode(values, TOY), TOY).astype(np.float64) - values).max()
    assert 0.99 * error_bound(TOY)[0] <= error + 1e-7


def test_values_a_little_beyond_their_bounds_become_the_bounds():
    values = np.array([[-1.00001, 1.00001]], dtype=np.float32)
    assert decode(encode(values, TOY), TOY).tolist() == [[-1.0, 1.0]]


def test_what_has_no_code_is_refused():
    with pytest.raises(ValueError, match="NaN or infinity"):
        encode(np.array([[np.nan, 0.0]], dtype=np.float32), TOY)


def test_another_storage_is_another_dataset_and_the_old_ones_keep_their_digest(identity, coded):
    assert identity.differences(coded) == ("storage: float32 and int16",)
    assert "storage" not in identity.to_json()
    assert Identity.from_json(coded.to_json()) == coded
    with pytest.raises(ValueError, match="storage must be one of float32, int16, got 'int8'"):
        replace(identity, storage="int8")


def test_a_real_dataset_is_a_third_as_large_and_differs_by_the_bound_alone(tmp_path):
    setup = setups.load("franka")
    identity = identity_of(setup, seed=0, episodes_per_shard=4, storage="int16")
    dataset = create(tmp_path / "coded", identity)
    [shard] = dataset.missing(4)
    report = collect_shard(setup, dataset, shard)
    exact = roll_out(setup, dataset, shard)
    columns = dataset.read(shard)
    error = np.abs(columns.xi.astype(np.float64) - np.stack([episode.xi for episode in exact]))
    assert (error.max(axis=(0, 2)) <= error_bound(identity) + 1e-5).all()
    assert error.max() > 0
    np.testing.assert_array_equal(columns.bad, np.stack([episode.bad for episode in exact]))
    assert columns.f.tolist() == [episode.f for episode in exact]
    assert report.size < 4 * 11_000 + 20_000
    assert not [problem for _, problems in verify(dataset) for problem in problems]
    assert rederive(setup, dataset, shard) == []


def test_a_stranger_restores_the_values_from_what_the_file_says(coded, fill, tmp_path):
    dataset = create(tmp_path / "coded", coded)
    fill(dataset, 8)
    path = dataset.path(dataset.shards()[0])
    metadata = pq.read_schema(path).metadata
    channels = json.loads(metadata[b"svaedc.identity"])["observation"]
    formula = json.loads(metadata[b"svaedc.layout"])["xi_value"].partition(",")[0]
    code = pq.read_table(path)["xi"].to_pylist()[2][20 + 7]
    low, high = channels[1][2:]
    value = eval(formula, {"low": low, "high": high, "code": code})
    assert value == pytest.approx(float(dataset.read(dataset.shards()[0]).xi[2, 1, 7]), abs=1e-6)
