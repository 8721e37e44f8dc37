"""Runs on recorded episodes against what is known of the extremes."""

import numpy as np
import pytest
import torch

from svaedc.bo.offline import Recorded, worth

RNG = np.random.default_rng(0)
X = RNG.random((120, 3), dtype=np.float32)
F = (1.0 - 2.0 * np.abs(X[:, 0] - 0.3)).astype(np.float32)
RECORDED = Recorded(X, F, (-1.0, 1.0))


def telling(x: torch.Tensor):
    """A model whose latent path is what the objective depends on."""
    return x[:, :1], 0.5 * torch.ones(len(x))


def misleading(x: torch.Tensor):
    """A model whose latent path has nothing to do with the controller."""
    noise = torch.sin(1e4 * x @ torch.tensor([[1.1], [2.3], [3.7]]))
    return noise, 0.5 * torch.ones(len(x))


def test_a_model_that_tells_is_worth_more_than_one_that_misleads():
    good, bad = (worth("svae", RECORDED, each, runs=3, count=4) for each in (telling, misleading))
    assert good.best > bad.best + 0.05
    assert good.mean > bad.mean + 0.1
    assert good.best <= F.max()


def test_random_search_over_everything_finds_the_mean_and_the_best():
    found = worth("screened-random", RECORDED, lambda x: (x, torch.full((len(x),), 0.5)), runs=2, count=36)
    assert found.mean == pytest.approx(F.mean(), abs=0.15)
    assert worth("svae", Recorded(X[:8], F[:8], (-1.0, 1.0)), telling, runs=1, count=6).best == F[:8].max()


def test_the_same_call_gives_the_same_worth():
    assert worth("svae-dc", RECORDED, telling, 2, 3) == worth("svae-dc", RECORDED, telling, 2, 3)


def test_a_controller_that_was_not_recorded_is_refused():
    with pytest.raises(ValueError, match="must be a recorded controller"):
        RECORDED.outcome(np.zeros(3, np.float32))
