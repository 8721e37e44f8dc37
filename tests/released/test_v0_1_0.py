"""What svaedc 0.1.0 wrote is read as before: datasets, models, states of training, comparisons, campaigns.

The files under `v0_1_0/` were written by commit 109d1f0, the last before the rooms. Each `.txt` and `.json`
beside them holds what that version said of them.
"""

import importlib
import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.comparison.worker import ComparisonJob
from cluster.hardware.executor import Executor
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.states import Approval, State
from svaedc.bo.history import History
from svaedc.data.episodes import Episodes, split
from svaedc.model import checkpoint
from svaedc.training.config import StageSettings, TrainingSettings, Weighting
from svaedc.training.loop import fit
from workers import setups
from workers.attempts import Attempts
from workers.collection.recompute import rederive
from workers.dataset.folder import open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.inventory import inventory
from workers.dataset.verification import verify

KEPT = Path(__file__).parent / "v0_1_0"


@pytest.fixture(autouse=True)
def one_thread():
    """Threads add in other orders."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


@pytest.mark.parametrize("name", ["dataset", "dataset-int16", "dataset-repeats"])
def test_datasets_keep_their_identity_their_fingerprint_and_every_byte_of_their_episodes(name):
    dataset = open_dataset(KEPT / name)
    digest, fingerprint = (KEPT / f"{name}.txt").read_text().split()
    assert (dataset.identity.digest, dataset.fingerprint()) == (digest, fingerprint)
    setup = setups.load(dataset.identity.setup)
    now = identity_of(
        setup,
        seed=dataset.identity.seed,
        episodes_per_shard=dataset.identity.episodes_per_shard,
        repeats=dataset.identity.repeats,
        storage=dataset.identity.storage,
    )
    assert now.differences(dataset.identity) == ()
    assert [defect for _, defects in verify(dataset) for defect in defects] == []
    assert list(inventory(dataset)) == []
    assert [defect for shard in dataset.shards() for defect in rederive(setup, dataset, shard)] == []


def episodes() -> tuple[Episodes, Episodes]:
    """Those that the model and the state of its training were made with."""
    rng = np.random.default_rng(0)
    x = rng.random((60, 48), dtype=np.float32)
    xi = np.tanh((x[:, :3, None] - 0.5) * np.linspace(0, 3, 40, dtype=np.float32))
    bad = (xi[:, 0] > 0.3).astype(np.float32)
    return split(Episodes(x, xi, bad, bad.mean(1), np.arange(60)), np.arange(9, 60, 10))


def test_a_model_says_of_controllers_what_it_said():
    model, metadata = checkpoint.load(KEPT / "model.pt")
    said = json.loads((KEPT / "model.json").read_text())
    tau, y = model.latent_means(
        torch.from_numpy(np.random.default_rng(0).random((60, 48), dtype=np.float32)[:4])
    )
    assert metadata["setup"] == "franka"
    np.testing.assert_allclose(tau.detach(), said["tau"], rtol=1e-5, atol=1e-6)
    np.testing.assert_allclose(y.detach(), said["y"], rtol=1e-5, atol=1e-6)


def test_an_interrupted_training_goes_on_to_the_same_weights():
    said = json.loads((KEPT / "model.json").read_text())
    written = said["settings"]
    settings = TrainingSettings(
        **{
            **written,
            "joint": StageSettings(**written["joint"]),
            "prior": StageSettings(**written["prior"]),
            "weighting": Weighting(**written["weighting"]),
        }
    )
    whole, _ = checkpoint.load(KEPT / "model.pt")
    model, _ = checkpoint.load(KEPT / "model.pt")
    with torch.no_grad():
        for parameter in model.parameters():
            parameter.zero_()  # all that matters is in the state
    reports = list(fit(model, *episodes(), settings, resume=checkpoint.read(KEPT / "training.pt")))
    assert len(reports) == said["updates"] - 2
    for name, value in whole.state_dict().items():
        torch.testing.assert_close(model.state_dict()[name], value, rtol=1e-4, atol=1e-5, msg=name)


def test_a_comparison_goes_on_with_the_same_controllers(tmp_path):
    shutil.copytree(KEPT / "comparison", tmp_path / "comparison")
    folder = ComparisonFolder(tmp_path / "comparison")
    setup = setups.load("quadratic-30d")
    identity = json.loads((folder.path / "comparison.json").read_text())
    assert folder.claim({name: identity[name] for name in identity if name != "model"}, "") == identity
    runs = folder.runs()
    assert [(str(key), len(trials)) for key, trials in runs.items()] == [
        *(("random 0", 5), ("random 1", 5), ("se 0", 5), ("se 1", 5)),
    ]
    job = ComparisonJob(folder, "quadratic-30d", "paper", (), pool_size=50, initial=2, trials=3)
    for key in (RunKey("random", 1), RunKey("se", 0)):
        path = key.path(folder.path)
        path.write_bytes(b"".join(path.read_bytes().splitlines(keepends=True)[:3]))
        with Attempts(setup) as attempts:
            assert len(list(job.run(key, setup, attempts))) == 2
        for again, trial in zip(folder.trials(key), runs[key], strict=True):
            np.testing.assert_array_equal(again.x, trial.x)
            assert again.f == trial.f


@pytest.mark.parametrize(("name", "method"), [("campaign", "se"), ("campaign-model", "svae-dc")])
def test_a_campaign_goes_on_with_the_controllers_of_its_own_version(name, method, tmp_path):
    shutil.copytree(KEPT / name, tmp_path / name)
    model = KEPT / "model.pt" if method == "svae-dc" else None
    plan = CampaignPlan(
        identify("franka-rehearsal", method, 2, 5, 40, model, Approval.POLICY), tmp_path / name, model, 0.0
    )
    executor = Executor(plan)
    before = executor.status()
    last = executor.advance()
    executor.close()
    said = json.loads((KEPT / f"{name}.json").read_text())
    assert before.identity.draws == 1
    assert [trial.state for trial in last.trials] == [State.MEASURED] * 4
    assert len(before.trials) == 3
    np.testing.assert_allclose([trial.x for trial in last.trials], said, rtol=1e-6)


def test_a_new_campaign_draws_what_a_comparison_of_its_seed_draws(tmp_path):
    plan = CampaignPlan(
        identify("franka-rehearsal", "se", 1, 5, 40, None, Approval.POLICY), tmp_path / "new", None, 0.0
    )
    executor = Executor(plan)
    first, second, third = [executor.advance() for _ in range(3)][-1].trials
    executor.close()
    job = ComparisonJob(ComparisonFolder(tmp_path), "franka", "paper", (), pool_size=40, initial=2, trials=1)
    shared = job.optimization(RunKey("se", 5), setups.load("franka"))
    np.testing.assert_array_equal(first.x.astype(np.float32), shared.initial(0))
    history = History.empty(48).append(shared.initial(0), first.f).append(shared.initial(1), second.f)
    np.testing.assert_array_equal(third.x.astype(np.float32), shared.build().suggest(history, shared.rng(2)))
    old = replace(shared, draws=1)
    assert not np.array_equal(old.initial(0), shared.initial(0))


TOLD = (
    ("workers", "setups"),
    ("workers.controllers.controller", "Command"),
    ("workers.controllers.controller", "Controller"),
    ("workers.controllers.controller", "unit_cube"),
    ("workers.controllers.reference", "euler_angles"),
    ("workers.dataset.cache", "training_cache"),
    ("workers.dataset.folder", "open_dataset"),
    ("workers.environments.environment", "Channel"),
    ("workers.environments.environment", "Environment"),
    ("workers.environments.environment", "Observed"),
    ("workers.gymnasium_environment", "SetupEnvironment"),
    ("workers.hardware", "ledger"),
    ("workers.hardware.driver", "Measurement"),
    ("workers.hardware.driver", "Motion"),
    ("workers.hardware.driver", "RobotFault"),
    ("workers.hardware.ledger", "MotionLedger"),
    ("workers.physics", "Physics"),
    ("workers.physics", "PhysicsRanges"),
    ("workers.physics", "around"),
    ("workers.pictures", "Size"),
    ("workers.pictures", "frames"),
    ("workers.rollout", "random_episode"),
    ("workers.setups", "Setup"),
    ("workers.setups", "load"),
    ("workers.simulation.bullet", "pybullet"),
    ("workers.simulation.cylinder", "Cylinder"),
    ("workers.simulation.description", "joint_indices"),
    ("workers.simulation.description", "load_robot"),
    ("workers.simulation.world", "World"),
    ("workers.tasks.own_bad", "conditions"),
    ("workers.tasks.task", "Task"),
)


@pytest.mark.parametrize(("module", "name"), TOLD)
def test_what_the_documentation_told_people_to_import_can_be_imported(module, name):
    found = importlib.import_module(module)
    if not hasattr(found, name):  # a module of that package
        found = importlib.import_module(f"{module}.{name}")
        assert found.__name__ == f"{module}.{name}"
