"""A small synthetic dataset: smooth random maps from x to trajectories, bad where the first one is high."""

import numpy as np
import pytest

CONTROLLER, OBSERVATIONS, STEPS = 6, 5, 40


@pytest.fixture(scope="session")
def bounds() -> tuple[list[float], list[float]]:
    return [-2.0] * OBSERVATIONS, [2.0] * OBSERVATIONS


@pytest.fixture(scope="session")
def episodes():
    from svaedc.data.episodes import Episodes

    rng = np.random.default_rng(0)
    x = rng.random((600, CONTROLLER), dtype=np.float32)
    time = np.linspace(0.0, 1.0, STEPS, dtype=np.float32)
    maps = rng.standard_normal((3, CONTROLLER, OBSERVATIONS), dtype=np.float32)
    amplitude, phase, slope = (np.tanh((x - 0.5) @ each)[..., None] for each in maps)
    xi = amplitude * np.sin(3.0 * time + 2.0 * phase) + slope * time
    bad = (xi[:, 0] > 0.3).astype(np.float32)
    return Episodes(x, xi, bad, bad.mean(1), np.arange(600))


@pytest.fixture(scope="session")
def halves(episodes):
    from svaedc.data.episodes import split

    return split(episodes, np.arange(9, 600, 10))


@pytest.fixture(scope="session")
def small_config():
    from svaedc.model.config import ModelConfig

    return ModelConfig(
        CONTROLLER,
        OBSERVATIONS,
        STEPS,
        channels=(8, 16),
        decoder_hidden=(32,),
        rank=20,
        prior_hidden=(32, 32),
        badness_hidden=(16,),
    )


@pytest.fixture
def model(small_config, halves, bounds):
    from svaedc.model.svae_dc import initialized_model

    return initialized_model(small_config, halves[0], bounds, seed=0)


@pytest.fixture
def batch(episodes):
    import torch

    return episodes.gather(np.arange(16), torch.device("cpu"))
