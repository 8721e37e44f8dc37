"""The four networks, each by itself."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from svaedc.model.config import decoded_length, encoded_length
from svaedc.model.networks import (
    PRIORS,
    Badness,
    DenseHead,
    Encoder,
    LowRankHead,
    convolutions,
    transposed_convolutions,
)
from svaedc.model.normalizer import TrainingStatistics


def test_convolutions_and_their_reverse_have_the_lengths_that_are_computed():
    xi = torch.rand(2, 3, 40)
    code = convolutions((3, 8, 16))(xi)
    assert code.shape == (2, 16, encoded_length(40, 2))
    assert transposed_convolutions((16, 8, 3))(code).shape == (2, 3, decoded_length(code.shape[2], 2))


def test_the_encoder_of_the_svae_is_blind_to_badness_and_the_other_is_not(small_config):
    torch.manual_seed(0)
    xi, good, bad = torch.rand(2, 5, 40), torch.zeros(2, 40), torch.ones(2, 40)
    for config, is_blind in ((small_config, False), (replace(small_config, psi_dim=0), True)):
        encoder = Encoder(config)
        one, other = encoder(xi, good, torch.zeros(2)), encoder(xi, bad, torch.ones(2))
        assert one.loc.shape == (2, config.latent_size)
        assert torch.equal(one.loc, other.loc) == is_blind


def plans(x: torch.Tensor) -> torch.Tensor:
    """Two channels of seven steps: one rises with x_0, the other swings with x_1."""
    times = torch.linspace(0, 1, 7)
    return torch.stack([x[:, :1] * times, torch.sin(6 * times * x[:, 1:2])], dim=1)


def reading(config):
    return replace(config, prior="plan", prior_hidden=(4, 5, 6, 7), plan_channels=2, plan_steps=7)


def test_the_prior_that_reads_plans_tells_controllers_apart_by_them(small_config):
    torch.manual_seed(0)
    network = PRIORS["plan"](reading(small_config))
    x = torch.rand(4, small_config.controller_dim).requires_grad_()
    with pytest.raises(RuntimeError, match="set plan_of"):
        network(x)
    network.plan_of = plans
    loc = network(x).loc
    assert loc.shape == (4, small_config.latent_size)
    network.plan_of = lambda x: -plans(x)
    assert not torch.allclose(network(x).loc, loc)
    loc.sum().backward()
    assert (x.grad.abs().sum(dim=0) > 0).all()


def test_a_prior_that_reads_plans_needs_some(small_config):
    with pytest.raises(ValueError, match=r"offers its plan, got one of 0 channels.*choose the prior `mlp`"):
        replace(reading(small_config), plan_channels=0)
    with pytest.raises(ValueError, match=r"at least 3 hidden sizes .* got \(8, 8\)"):
        replace(reading(small_config), prior_hidden=(8, 8))


@pytest.mark.parametrize("kind", sorted(PRIORS))
def test_scales_of_latents_end_at_their_bounds_however_far_the_controller(small_config, kind):
    torch.manual_seed(0)
    network = PRIORS[kind](reading(small_config) if kind == "plan" else replace(small_config, prior=kind))
    network.plan_of = plans
    p = network(1e6 * torch.randn(50, small_config.controller_dim))
    bounds = small_config.latent_scale
    assert p.loc.shape == (50, small_config.latent_size)
    assert p.scale.min().item() == pytest.approx(bounds.floor, rel=1e-3)
    assert p.scale.max().item() == pytest.approx(bounds.cap, rel=1e-3)


def test_badness_is_a_share_whatever_psi_says(small_config):
    torch.manual_seed(0)
    y = Badness(small_config)(100 * torch.randn(50, small_config.psi_size))
    assert y.loc.shape == (50,)
    assert ((y.loc >= 0) & (y.loc <= 1)).all()
    assert y.loc.std() > 0


def statistics(config) -> TrainingStatistics:
    rng = np.random.default_rng(0)
    shape = (config.observation_dim, config.time_steps)
    return TrainingStatistics(
        low=np.zeros(shape[0], np.float32),
        high=np.ones(shape[0], np.float32),
        median=rng.random(shape, dtype=np.float32),
        spread=rng.random(shape[0], dtype=np.float32),
        directions=rng.random((config.rank, *shape), dtype=np.float32),
    )


def test_the_low_rank_head_is_the_median_plus_coefficients_times_the_directions(small_config):
    torch.manual_seed(0)
    head, measured = LowRankHead(small_config), statistics(small_config)
    head.adopt(measured)
    tau = torch.randn(3, small_config.tau_size)
    with torch.no_grad():
        coefficients = head.coefficients(head.trunk(tau)).numpy()
        found = head(tau).loc.numpy()
    residual = np.einsum("br,rot->bot", coefficients, measured.directions)
    np.testing.assert_allclose(
        found, measured.median + measured.spread[:, None] * residual, rtol=1e-4, atol=1e-5
    )


def test_the_dense_head_starts_from_no_statistics(small_config):
    torch.manual_seed(0)
    head, tau = DenseHead(replace(small_config, head="dense")), torch.randn(3, small_config.tau_size)
    before = head(tau).loc
    head.adopt(statistics(small_config))
    assert before.shape == (3, small_config.observation_dim, small_config.time_steps)
    assert torch.equal(head(tau).loc, before)
