"""What a comparison refuses before anything runs: names, grids, models and pools that do not fit."""

import json
import sys
from dataclasses import replace

import pytest
import torch

from cluster.comparison.plan import Grid, plan_comparison, usable
from cluster.comparison.records import RunKey
from cluster.config import CompareSettings
from cluster.errors import UsageError, UserError
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc
from svaedc.training.presets import Sizes, compact, vary
from tests.cluster.comparison.comparing import SETTINGS, untrained
from workers import setups
from workers.dataset.shards import sha256

CART = """
from workers import setups
from workers.dataset.shards import sha256

def setup():
    return setups.load("quadratic-30d")
"""
METHOD = """
from svaedc.bo.strategies import UniformSearch

def mine(problem):
    return UniformSearch(problem.dimensions)
"""


def test_unknown_names_are_refused_with_the_nearest(compared):
    with pytest.raises(UsageError, match="did you mean 'svae-dc'"):
        compared("svae-cd")
    with pytest.raises(UsageError, match="did you mean 'paper'"):
        compared(gap="papre")
    with pytest.raises(UsageError, match="did you mean 'object1_mass'"):
        compared(gap="object1_mas=2")
    with pytest.raises(UsageError, match=r"object1_mass must satisfy low <= high, got \[3.0, 2.0\]"):
        compared(gap="object1_mass=3:2")


@pytest.mark.parametrize(
    ("methods", "message"),
    [((), "at least one of bbk-kl, .*, got none"), (("se", "se"), "once, got se, se")],
)
def test_a_grid_names_every_method_once_and_at_least_one(methods, message):
    with pytest.raises(UsageError, match=message):
        Grid(methods, seed=0, runs=1)


def test_a_method_without_its_model_is_refused(compared):
    with pytest.raises(UsageError, match="svae-dc need a trained model: name its folder with --model"):
        compared("random,svae-dc")


def test_a_model_of_another_setup_or_a_damaged_one_is_refused(compared, tmp_path):
    with pytest.raises(UserError, match="made for setup 'yumi', not 'franka'"):
        compared("svae", models=[untrained(tmp_path / "other", setup="yumi")])
    (tmp_path / "other" / "model.pt").write_bytes(b"no")
    with pytest.raises(UserError, match="damaged"):
        compared("svae", models=[tmp_path / "other"])
    with pytest.raises(UserError, match="cannot use the model"):
        compared("svae", models=[tmp_path / "nowhere"])


def planned_with(**changes):
    usual = {
        "setup": setups.load("franka"),
        "grid": Grid(("random", "svae-dc"), seed=1000, runs=1),
        "trials": 5,
        "gap": "paper",
        "settings": SETTINGS,
    }
    return plan_comparison(**{**usual, **changes})


def test_a_model_without_badness_is_refused_for_methods_that_compress_before_anything_runs(tmp_path):
    torch.manual_seed(0)
    model = SvaeDc(vary(compact(Sizes(48, 25, 100)), {"model": "svae"}).model)
    (tmp_path / "svae").mkdir()
    checkpoint.save(tmp_path / "svae" / "model.pt", model, {"setup": "franka"})
    with pytest.raises(UserError, match="'svae-dc': the model must predict badness, got an SVAE"):
        planned_with(models=[tmp_path / "svae"], folder=tmp_path / "out")
    planned_with(grid=Grid(("svae",), 1000, 1), models=[tmp_path / "svae"], folder=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_pool_with_fewer_controllers_than_trials_is_refused_naming_the_setting(tmp_path):
    few, grid = CompareSettings(pool_size=15), Grid(("screened-random",), 1000, 1)
    model = untrained(tmp_path / "model")
    with pytest.raises(
        UserError, match=r"compare\.pool_size is 15.*may choose from 5 of 15 .* fewer than its 6 trials"
    ):
        planned_with(grid=grid, trials=6, models=[model], settings=few, folder=tmp_path / "out")


def claimed(folder, setup, methods=("random",)):
    plan = planned_with(grid=Grid(methods, 1000, 1), setup=setup, models=[], folder=folder)
    (folder / "runs").mkdir(exist_ok=True)
    return plan.claim()


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A setup of a user's own, whose module is loaded."""
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "cart_pole.py").write_text(CART)
    yield setups.load("cart_pole")
    sys.modules.pop("cart_pole")


def test_runs_of_a_setup_whose_code_has_changed_are_not_mixed(tmp_path, own):
    assert claimed(tmp_path, own) == claimed(tmp_path, own)
    since = rf"cart_pole\.py has changed since the comparison in {tmp_path} was begun"
    remedy = "put the file back as it was, or choose another folder with --out"
    with pytest.raises(
        UserError, match=rf"{since} \(nothing that its setup declares: its code did\); {remedy}"
    ):
        claimed(tmp_path, replace(own, code="2" * 64))
    with pytest.raises(
        UserError, match=rf"{since} \(horizon was 2, is 9; success was .*, is 0\.5\); {remedy}"
    ):
        claimed(tmp_path, replace(own, code="2" * 64, horizon=9, success=0.5))
    with pytest.raises(
        UserError,
        match=r"what cart_pole\.py declares has changed .* \(horizon was 2, is 9\), though the file has not",
    ):
        claimed(tmp_path, replace(own, horizon=9))


def test_a_folder_that_does_not_know_what_a_setup_declared_learns_it(tmp_path, own):
    claimed(tmp_path, own)
    path = tmp_path / "comparison.json"
    identity = json.loads(path.read_text())
    declared = identity.pop("setup_declares")
    path.write_text(json.dumps(identity))
    with pytest.raises(
        UserError, match=r"was begun \(what in it, this folder does not tell\); put the file back"
    ):
        claimed(tmp_path, replace(own, code="2" * 64, horizon=9))
    assert "setup_declares" not in claimed(tmp_path, own)
    assert json.loads(path.read_text()) == {**identity, "setup_declares": declared}


def test_runs_of_a_method_whose_code_has_changed_are_not_mixed_and_those_of_others_go_on(tmp_path, own):
    module = tmp_path / "my_method.py"
    module.write_text(METHOD)
    claimed(tmp_path, own)
    assert "method_digests" not in json.loads((tmp_path / "comparison.json").read_text())
    claimed(tmp_path, own, ("random", "my_method:mine"))
    module.write_text(module.read_text() + "# changed\n")
    with pytest.raises(
        UserError,
        match=r"my_method\.py has changed since the runs of my_method:mine in .* were begun; put it back",
    ):
        claimed(tmp_path, own, ("my_method:mine",))
    claimed(tmp_path, own)
    sys.modules.pop("my_method")
    digests = json.loads((tmp_path / "comparison.json").read_text())["method_digests"]
    assert list(digests) == ["my_method:mine"]


def test_a_stand_in_takes_the_model_of_what_it_stands_in_for_and_of_the_same_channels(tmp_path):
    on_franka, on_yumi = (untrained(tmp_path / name, setup=name) for name in ("franka", "yumi"))
    assert usable(on_franka, setups.load("franka-rehearsal"))[1] == "franka"
    assert usable(on_franka, setups.load("franka"))[1] == "franka"
    own = untrained(tmp_path / "own", setup="franka-rehearsal")
    assert usable(own, setups.load("franka-rehearsal"))[1] == "franka-rehearsal"
    with pytest.raises(UserError, match="made for setup 'yumi', not 'franka-rehearsal'"):
        usable(on_yumi, setups.load("franka-rehearsal"))
    assert usable(own, setups.load("franka"))[1] == "franka-rehearsal"
    slower = untrained(tmp_path / "slower", setup="yumi-rehearsal")
    with pytest.raises(UserError, match="made for setup 'yumi-rehearsal', not 'yumi', which differs"):
        usable(slower, setups.load("yumi"))


@pytest.mark.slow
def test_more_slots_than_cpus_are_refused(compared):
    with pytest.raises(UserError, match="needs 7 CPUs"):
        compared("random", settings=CompareSettings(slots=7, pool_size=200))


def test_with_several_models_the_runs_take_turns(tmp_path):
    folders = [untrained(tmp_path / name) for name in ("one", "other")]
    plan = planned_with(models=folders, folder=tmp_path / "out")
    digests = plan.model.split("+")
    assert digests == [sha256(folder / "model.pt") for folder in folders]
    used = [plan.job.optimization(RunKey("svae-dc", run), plan.setup).model for run in range(1000, 1004)]
    assert used[0] is used[2]
    assert used[1] is used[3]
    assert used[0] is not used[1]
