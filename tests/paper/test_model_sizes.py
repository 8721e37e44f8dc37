"""Sizes and schedules the paper states (sections 3 and 5, figure 9)."""

import pytest
import torch

from svaedc.model.config import ModelConfig, ScaleBounds
from svaedc.model.distributions import DiagonalLaplace
from svaedc.model.svae_dc import SvaeDc
from svaedc.training.presets import Sizes, paper

FRANKA = Sizes(controller_dim=48, observation_dim=25, time_steps=500)


def linear(inputs: int, outputs: int) -> int:
    return (inputs + 1) * outputs


def convolution(inputs: int, outputs: int) -> int:
    return (4 * inputs + 1) * outputs


def test_the_paper_s_configuration_is_the_one_of_section_5():
    model, training = paper(FRANKA)
    assert model.channels == (32, 64, 128)
    assert model.prior_hidden == (512, 256, 128, 128)
    assert model.badness_hidden == (64, 64)
    assert (model.path_length, model.tau_dim, model.tau_size) == (3, 3, 9)
    assert (model.distribution, model.head, model.prior) == ("laplace", "dense", "deconv")
    assert (training.batch_size, training.joint.optimiser) == (32, "rmsprop")
    assert [training.joint.learning_rate_at(k) for k in (0, 5_000, 99_999)] == [1e-4, 5e-5, 1e-5]
    assert (training.weighting.kl, training.weighting.y, training.weighting.warm_up) == (1.0, 1.0, 0.0)
    assert training.prior.updates == 0


def test_the_paper_s_parameters_count_as_by_hand():
    with torch.device("meta"):
        model = SvaeDc(paper(FRANKA).model)
    latent = 2 * 12
    # 500 steps become 249, 123 and 60; 3 become 8, 18 and 38; 1 becomes 4, 10, 22 and 46.
    posterior = (
        convolution(26, 32) + convolution(32, 64) + convolution(64, 128) + linear(128 * 60 + 1, latent)
    )
    deconvolutions = [(48, 512), (512, 256), (256, 128), (128, 128)]
    prior = sum(4 * a * b + b for a, b in deconvolutions) + linear(128 * 46, latent)
    trunk = sum(4 * a * b + b for a, b in [(3, 128), (128, 64), (64, 32)])
    decoder = trunk + linear(32 * 38, 2 * 25 * 500)
    badness = linear(3, 64) + linear(64, 64) + linear(64, 2)
    assert sum(value.numel() for value in model.parameters()) == posterior + prior + decoder + badness
    assert 31e6 < posterior + prior + decoder + badness < 33e6


@pytest.mark.parametrize(
    ("path_length", "tau_dim", "channels"), [(5, 6, (64, 128, 256)), (15, 12, (256, 512, 1024))]
)
def test_the_larger_latent_spaces_of_the_paper_give_a_finite_bound(path_length, tau_dim, channels):
    torch.manual_seed(0)
    config = ModelConfig(
        controller_dim=48,
        observation_dim=25,
        time_steps=40,
        path_length=path_length,
        tau_dim=tau_dim,
        channels=channels,
        prior="deconv",
        prior_hidden=(channels[-1], 256, 128, 128),
    )
    model = SvaeDc(config)
    bound = model.elbo(torch.rand(2, 48), torch.rand(2, 25, 40), torch.zeros(2, 40), torch.rand(2))
    assert torch.isfinite(bound).all()
    assert model.latent_means(torch.rand(2, 48))[0].shape == (2, path_length * tau_dim)


def test_without_information_the_bound_is_the_likelihood_alone():
    """When q equals p(.|x) the KL vanishes: the bound is log p(xi|tau) + log p(y|psi)."""
    torch.manual_seed(0)
    model = SvaeDc(ModelConfig(6, 5, 40, latent_scale=ScaleBounds(0.5, 2.0)))
    for latent in (model.posterior_network.latent, model.prior_network.latent):
        torch.nn.init.zeros_(latent.linear.weight)
        torch.nn.init.zeros_(latent.linear.bias)
    terms = model(torch.rand(4, 6), torch.rand(4, 5, 40), torch.zeros(4, 40), torch.rand(4))
    torch.testing.assert_close(terms.kl, torch.zeros(4))
    assert isinstance(model.prior(torch.rand(1, 6)), DiagonalLaplace)
