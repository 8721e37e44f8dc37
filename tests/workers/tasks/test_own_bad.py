"""G_bad supplied by users: stored as they say, never mixed, and refused with a reason when it is wrong."""

import itertools
import json
import sys
from dataclasses import replace
from functools import partial

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cluster.datasets.worker import RolloutActor
from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.cache import training_cache
from workers.dataset.folder import create
from workers.dataset.identity import Identity, identity_of
from workers.dataset.shards import Shard
from workers.dataset.statistics import statistics
from workers.dataset.verification import verify
from workers.environments.tabletop import Tabletop
from workers.gymnasium_environment import SetupEnvironment
from workers.rollout import random_episode
from workers.setups.franka import MODEL
from workers.setups.user_bad import with_bad
from workers.tasks.own_bad import conditions

SHIFT = 7
SOURCE = f"""
import numpy as np
from workers.tasks.own_bad import conditions

def rough(observed):
    x, y, z = observed.signals["hand_position"]
    return np.clip(np.abs(y) + np.abs(np.sin(200 * x)), 0, 1)

def flipped(observed):
    return 1 - rough(observed)

def shifted(observed):
    return np.concatenate([np.zeros({SHIFT}), rough(observed)[:-{SHIFT}]])

@conditions("left", "high", "never")
def rows(observed):
    x, y, z = observed.signals["hand_position"]
    return np.stack([y > 0.2, z > 0.2, z > 9])

def first_place(observed):
    return np.clip(observed.xi[7], 0, 1)

def yes_or_no(observed):
    return observed.xi[0] > 0.4

def all_channels(observed):
    return np.zeros_like(observed.xi)

def not_a_number(observed):
    return np.where(np.arange(observed.xi.shape[1]) == 17, np.nan, 0.5)

def too_large(observed):
    return np.full(observed.xi.shape[1], 1.5)

def words(observed):
    return np.full(observed.xi.shape[1], "bad")

def misspelt(observed):
    return observed.signals["hand_positions"][0]

def nothing(observed):
    pass

def writes(observed):
    observed.xi[:] = 0.0

@conditions("one", "two")
def one_row(observed):
    return observed.xi[:1] > 0.4

@conditions("one")
def numbers(observed):
    return observed.xi[:1]
"""


@pytest.fixture(autouse=True)
def module(tmp_path, monkeypatch):
    """The file of the importable module `gentle`."""
    path = tmp_path / "modules" / "gentle.py"
    path.parent.mkdir()
    path.write_text(SOURCE)
    monkeypatch.syspath_prepend(path.parent)
    monkeypatch.delitem(sys.modules, "gentle", raising=False)
    return path


@pytest.fixture(scope="module")
def franka():
    return replace(setups.load("franka"), horizon=60)


@pytest.fixture(scope="module")
def environment(franka):
    with franka.open() as opened:
        yield opened


@pytest.fixture
def episode(franka, environment):
    """name of a function, index -> that episode of seed 0 under that G_bad."""
    return lambda name, index=1: random_episode(with_bad(franka, f"gentle:{name}"), environment, 0, index)


def test_degrees_are_stored_as_the_function_gives_them_and_y_is_their_mean(franka, environment, episode):
    own, rough = random_episode(franka, environment, 0, 1), episode("rough")
    environment.reset(rough.physics)
    command = franka.controller.start(rough.x, environment, 60)
    x, y, _ = environment.observed([environment.step(command(t)) for t in range(60)]).signals["hand_position"]
    expected = [min(1, abs(b) + abs(np.sin(200 * a))) for a, b in zip(x, y, strict=True)]
    assert rough.bad.dtype == np.float32
    assert rough.bad == pytest.approx(expected, rel=1e-6)
    assert np.ptp(rough.bad) > 0.1
    assert rough.y == pytest.approx(sum(rough.bad.tolist()) / 60, rel=1e-12)
    assert (rough.xi.tobytes(), rough.f, rough.x.tolist()) == (own.xi.tobytes(), own.f, own.x.tolist())


def test_flipping_a_function_flips_the_stored_degrees_and_y(episode):
    rough, flipped = episode("rough"), episode("flipped")
    assert flipped.bad == pytest.approx(1 - rough.bad, abs=1e-7)
    assert flipped.y == pytest.approx(1 - rough.y, abs=1e-7)


def test_shifting_a_function_in_time_shifts_the_stored_degrees_and_y(episode):
    rough, shifted = episode("rough"), episode("shifted")
    assert shifted.bad[:SHIFT].tolist() == [0.0] * SHIFT
    assert np.array_equal(shifted.bad[SHIFT:], rough.bad[:-SHIFT])
    lost = rough.bad[-SHIFT:].sum(dtype=np.float64)
    assert shifted.y == pytest.approx(rough.y - lost / 60, abs=1e-9)


def test_rows_of_booleans_are_stored_as_bits(franka, environment, episode):
    rows = episode("rows")
    environment.reset(rows.physics)
    command = franka.controller.start(rows.x, environment, 60)
    _, y, z = environment.observed([environment.step(command(t)) for t in range(60)]).signals["hand_position"]
    assert rows.bad.tolist() == ((y > 0.2) + 2 * (z > 0.2)).tolist()
    assert rows.y == np.mean((y > 0.2) | (z > 0.2))
    assert with_bad(franka, "gentle:rows").conditions == ("left", "high", "never")


def test_yes_and_no_are_degrees_too(episode):
    answers = episode("yes_or_no")
    assert answers.bad.tolist() == (answers.xi[0] > 0.4).astype(float).tolist()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "all_channels",
            r"one number per step, shape \(60,\), got float32 of shape \(25, 60\); reduce the other",
        ),
        ("not_a_number", r"numbers in \[0, 1\], got nan in step 17; scale them"),
        ("too_large", r"numbers in \[0, 1\], got 1\.5 in step 0; .*np\.clip"),
        ("words", r"one number per step.*got <U3"),
        ("nothing", r"one number per step.*got object of shape \(\)"),
        ("misspelt", r"failed with KeyError: 'hand_positions'.*the signals hand_position, table_contact"),
        ("writes", r"failed with ValueError: .*read-only"),
        ("one_row", r"2 conditions and must return bool of shape \(2, 60\), got bool of shape \(1, 60\)"),
        ("numbers", r"1 conditions and must return bool of shape \(1, 60\), got float32.*or unmark it"),
    ],
)
def test_a_wrong_function_is_refused_with_what_is_expected_and_what_to_do(episode, name, message):
    with pytest.raises(ValueError, match=f"gentle:{name} .*{message}"):
        episode(name)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("gentle", "must be named as module:function, got 'gentle'"),
        ("gentle:ruogh", "module 'gentle' has no function 'ruogh'; did you mean 'rough'"),
        ("gentle:SHIFT", "has no function 'SHIFT'"),
        ("gentel:rough", "cannot import the module 'gentel': No module named 'gentel'.*PYTHONPATH"),
    ],
)
def test_a_function_that_is_not_there_is_named(franka, name, message):
    with pytest.raises(LookupError, match=message):
        with_bad(franka, name)


def test_a_module_that_is_no_python_is_refused_with_the_place(franka, module):
    (module.parent / "broken.py").write_text("def rough(:\n")
    with pytest.raises(LookupError, match=r"cannot import the module 'broken': .*broken\.py, line 1"):
        with_bad(franka, "broken:rough")


def test_a_function_has_one_to_seven_conditions():
    with pytest.raises(ValueError, match="1 to 7 conditions, got 8"):
        conditions(*"abcdefgh")
    with pytest.raises(ValueError, match="got 0"):
        conditions()


@pytest.fixture
def dataset(franka, tmp_path):
    """Six episodes under the graded G_bad `rough`."""
    setup = with_bad(franka, "gentle:rough")
    created = create(tmp_path / "dataset", identity_of(setup, seed=0, episodes_per_shard=4))
    for shard in created.missing(6):
        collect_shard(setup, created, shard)
    return created


def test_a_graded_dataset_gives_training_its_degrees_and_exact_y(dataset, episode, tmp_path):
    assert [found for _, found in verify(dataset)] == [[], []]
    cache = training_cache(dataset, 5, tmp_path / "cache")
    for row in range(6):
        expected = episode("rough", row)
        assert np.array_equal(cache.bad[row], expected.bad[4::5])
        assert cache.y[row] == np.float32(expected.y)
    means = [episode("rough", row).y for row in range(6)]
    assert statistics(dataset).bad_steps == pytest.approx({"rough": np.mean(means)})
    metadata = pq.read_schema(dataset.path(Shard(0, 4))).metadata
    assert json.loads(metadata[b"svaedc.layout"])["bad"] == "degree of badness of each step, in [0, 1]"


def test_degrees_that_were_tampered_with_are_found(dataset):
    table = pq.read_table(dataset.path(Shard(0, 4)))
    bad = dataset.read(Shard(0, 4)).bad.reshape(-1).copy()
    bad[0] = 7.0
    field = table.schema.field("bad")
    column = pa.FixedSizeListArray.from_arrays(pa.array(bad), type=field.type)
    changed = table.set_column(table.schema.get_field_index("bad"), field, column)
    pq.write_table(changed, dataset.path(Shard(0, 4)))
    found = [problem.what for _, problems in verify(dataset) for problem in problems]
    assert "it holds degrees of badness outside [0, 1]" in found
    assert "y is not the mean of the bad steps" in found


def test_datasets_of_different_functions_never_mix(dataset, franka):
    assert Identity.from_json(dataset.identity.to_json()) == dataset.identity
    for name, message in (
        ("gentle:flipped", "differ in .*bad_name: gentle:rough and gentle:flipped"),
        ("", "differ in .*bad_kind: graded and bits"),
    ):
        other = identity_of(with_bad(franka, name), seed=0, episodes_per_shard=4)
        with pytest.raises(ValueError, match=message):
            create(dataset.folder, other)


def test_a_setups_own_g_bad_leaves_no_trace_in_the_identity(franka):
    identity = identity_of(with_bad(franka, ""), seed=0, episodes_per_shard=8)
    assert identity == identity_of(franka, seed=0, episodes_per_shard=8)
    assert "bad_" not in identity.to_json()


def test_a_worker_loads_the_function_by_its_name_and_refuses_another_file(tmp_path, module, monkeypatch):
    setup = with_bad(setups.load("franka"), "gentle:rough")
    dataset = create(tmp_path / "dataset", identity_of(setup, seed=0, episodes_per_shard=2))
    RolloutActor("franka", str(dataset.folder)).collect(Shard(0, 2))
    assert dataset.read(Shard(0, 2)).bad.dtype == np.float32
    module.write_text(SOURCE.replace("200 * x", "201 * x"))
    monkeypatch.delitem(sys.modules, "gentle")
    with pytest.raises(ValueError, match=r"would roll out other episodes .* differ in bad_digest: "):
        RolloutActor("franka", str(dataset.folder))


def test_a_worker_tries_the_function_before_it_takes_a_shard(tmp_path):
    setup = with_bad(setups.load("franka"), "gentle:too_large")
    dataset = create(tmp_path / "dataset", identity_of(setup, seed=0, episodes_per_shard=2))
    with pytest.raises(ValueError, match=r"gentle:too_large must return numbers in \[0, 1\], got 1\.5"):
        RolloutActor("franka", str(dataset.folder))


class Exploding(Tabletop):
    """The Franka's scene, whose numbers stop being numbers."""

    def observed(self, records):
        seen = super().observed(records)
        seen.xi[:, -1] = np.nan
        return seen


def test_an_episode_that_diverges_is_entirely_bad(franka):
    setup = with_bad(replace(franka, build=partial(Exploding, MODEL)), "gentle:rough")
    with setup.open() as environment:
        diverged = random_episode(setup, environment, 0, 0)
    assert diverged.stop == "diverged"
    assert diverged.bad.tolist() == np.ones(60, np.float32).tolist()
    assert diverged.bad.dtype == np.float32
    assert diverged.y == 1.0


def test_steps_that_a_stop_rule_spared_have_the_degree_one(franka, environment, episode):
    calls = itertools.count(1)
    stopping = replace(with_bad(franka, "gentle:rough"), stop=lambda _: "tired" if next(calls) == 20 else "")
    stopped, whole = random_episode(stopping, environment, 0, 1), episode("rough")
    assert stopped.stop == "tired"
    assert np.array_equal(stopped.bad[:19], whole.bad[:19])
    assert stopped.bad[19:].tolist() == [1.0] * 41
    assert stopped.y == pytest.approx((whole.bad[:19].sum(dtype=np.float64) + 41) / 60)
    assert stopped.f == np.float32(franka.objective_limits[0])
    assert stopping.conditions == ("rough",)


def test_gymnasium_reports_the_degree_of_a_step(franka):
    adapter = SetupEnvironment(with_bad(franka, "gentle:first_place"))
    seen, start = adapter.reset(seed=3)
    moved, *_, first = adapter.step(np.zeros(7, np.float32))
    adapter.close()
    assert start["bad"] == seen[7]
    assert first["bad"] == moved[7]
    assert 0.0 < first["bad"] < 1.0
