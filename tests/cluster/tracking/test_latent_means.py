"""The MLflow model of a checkpoint."""

import numpy as np
import pytest
import torch

from cluster.tracking.latent_means import LatentMeans
from cluster.tracking.models import log_model
from svaedc.model import checkpoint
from svaedc.model.config import ModelConfig
from svaedc.model.svae_dc import SvaeDc


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
        address = log_model(run, path, controller_dim=4, tau_size=9, step=7)
    kept = tracker.client.get_logged_model(address.removeprefix("models:/"))
    assert (kept.name, kept.source_run_id, kept.status) == ("latent-means", run.id, "READY")
    [output] = tracker.client.get_run(run.id).outputs.model_outputs
    assert (output.model_id, output.step) == (kept.model_id, 7)
