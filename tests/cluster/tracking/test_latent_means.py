"""The MLflow model of a checkpoint."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import torch

from cluster.optimization.models import let_read_plans
from cluster.tracking.latent_means import LatentMeans
from cluster.tracking.models import _save, log_model
from svaedc.model import checkpoint
from svaedc.model.config import ModelConfig
from svaedc.model.svae_dc import SvaeDc
from workers import setups


@pytest.fixture
def path(tmp_path):
    torch.manual_seed(0)
    config = ModelConfig(4, 3, 40, channels=(8,), decoder_hidden=(8,), rank=2, prior_hidden=(8,))
    checkpoint.save(tmp_path / "model.pt", SvaeDc(config), {})
    return tmp_path / "model.pt"


def test_its_answers_are_the_latent_means_of_the_checkpoint(path):
    x = np.random.default_rng(0).random((5, 4))
    answer = LatentMeans(path).predict(x)
    with torch.no_grad():
        tau, y = checkpoint.load(path)[0].latent_means(torch.tensor(x).float())
    assert np.array_equal(answer["tau"], tau.numpy())
    assert np.array_equal(answer["y"], y.numpy())
    assert answer["tau"].shape == (5, 9)


def test_rows_of_a_table_are_controllers_too(path):
    listed = [[0.1, 0.2, 0.3, 0.4]]
    assert LatentMeans(path).predict(listed)["y"].shape == (1,)


def test_a_model_in_the_store_is_an_output_of_its_run(path, tracker):
    with tracker.run("modelled", "train", {}) as run:
        address = log_model(run, path, checkpoint.load(path)[0], step=7)
    kept = tracker.client.get_logged_model(address.removeprefix("models:/"))
    assert (kept.name, kept.source_run_id, kept.status) == ("latent-means", run.id, "READY")
    [output] = tracker.client.get_run(run.id).outputs.model_outputs
    assert (output.model_id, output.step) == (kept.model_id, 7)


@pytest.mark.parametrize("setup", ["franka", "yumi"])
@pytest.mark.slow
def test_a_model_that_reads_plans_answers_without_the_code_of_its_robot(setup, tmp_path):
    robot = setups.load(setup)
    torch.manual_seed(0)
    channels = len(robot.controller.planned)
    config = ModelConfig(48, 3, 40, channels=(8,), decoder_hidden=(8,), rank=2, prior_hidden=(8,))
    model = SvaeDc(replace(config, prior="plan", prior_hidden=(8, 8, 8), plan_channels=channels)).eval()
    checkpoint.save(tmp_path / "model.pt", model, {"setup": setup})
    let_read_plans(model, setup)
    (tmp_path / "saved").mkdir()
    _save(tmp_path / "saved", tmp_path / "model.pt", model)
    x = np.random.default_rng(0).random((5, 48))
    program = (
        "import sys, numpy as np; from pathlib import Path;"
        "from cluster.tracking.latent_means import LatentMeans;"
        "answer = LatentMeans(Path(sys.argv[1])).predict(np.load(sys.argv[2]));"
        "np.save(sys.argv[3], answer['tau']); print('workers.setups.registry' in sys.modules)"
    )
    np.save(tmp_path / "x.npy", x)
    arguments = [str(tmp_path / name) for name in ("saved/data", "x.npy", "tau.npy")]
    said = subprocess.check_output([sys.executable, "-c", program, *arguments], encoding="utf-8")
    assert said.strip() == "False"
    with torch.no_grad():
        tau, _ = model.latent_means(torch.tensor(x).float())
    np.testing.assert_allclose(np.load(tmp_path / "tau.npy"), tau.numpy(), rtol=1e-5, atol=1e-6)
