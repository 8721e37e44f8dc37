import numpy as np
import pytest
import torch

from svaedc.bo.simulated.encoding import latent_paths
from svaedc.model.config import ModelConfig
from svaedc.model.svae_dc import SvaeDc

CONFIG = ModelConfig(controller_dim=3, observation_dim=2, time_steps=40)


def test_latent_paths_are_the_means_of_q_whatever_the_number_of_episodes_at_once():
    torch.manual_seed(0)
    model, rng = SvaeDc(CONFIG).eval(), np.random.default_rng(0)
    xi = rng.random((300, 2, 40), dtype=np.float32)
    bad = (rng.random((300, 40)) < 0.2).astype(np.float32)
    y = bad.mean(axis=1)
    found = latent_paths(model, xi, bad, y)
    assert found.shape == (300, CONFIG.tau_size)
    with torch.no_grad():
        q = model.posterior(*(torch.tensor(part[[7, 290]]) for part in (xi, bad, y)))
    np.testing.assert_allclose(found[[7, 290]], q.loc[:, : CONFIG.tau_size].numpy(), rtol=1e-4, atol=1e-6)


def test_trajectories_of_another_size_are_refused():
    model = SvaeDc(CONFIG).eval()
    with pytest.raises(ValueError, match=r"takes xi \[obs, time\] \(2, 40\), got \(2, 39\)"):
        latent_paths(
            model, np.zeros((1, 2, 39), np.float32), np.zeros((1, 39), np.float32), np.zeros(1, np.float32)
        )
