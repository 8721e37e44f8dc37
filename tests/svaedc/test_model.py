"""The bound against its sampled form, shapes, and what a model promises to the kernels."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import torch

from svaedc.architecture import ModelConfig
from svaedc.model import SvaeDc, initialised

VARIANTS = [
    pytest.param(
        {"distribution": distribution, "head": head, "prior": prior}, id=f"{distribution}-{head}-{prior}"
    )
    for distribution, head, prior in product(
        ("laplace", "gaussian"), ("low-rank", "dense"), ("mlp", "deconv")
    )
]


@pytest.fixture(params=VARIANTS)
def variant(request, small_config, halves, bounds):
    return initialised(replace(small_config, **request.param), halves[0], bounds, seed=1).eval()


def test_the_bound_is_the_mean_of_its_sampled_four_term_form(variant, batch):
    """E_q[log p(xi|tau) + log p(y|psi) + log p(tau,psi|x) - log q(tau,psi|xi,y)] by brute force."""
    torch.manual_seed(0)
    with torch.no_grad():
        q, p = variant.posterior(batch.xi, batch.bad, batch.y), variant.prior(batch.x)
        xi = variant.normaliser.scaled(batch.xi)
        sampled, closed = [], []
        for _ in range(400):
            code = q.rsample()
            tau, psi = variant.split(code)
            likelihood = variant.p_xi(tau).log_prob(xi) + variant.p_y(psi).log_prob(batch.y)
            sampled.append(likelihood + p.log_prob(code) - q.log_prob(code))
            closed.append(variant.elbo(*batch))
    four_terms, bound = torch.stack(sampled), torch.stack(closed)
    error = (four_terms.var(0) + bound.var(0)).sqrt() / 400**0.5
    assert ((four_terms.mean(0) - bound.mean(0)).abs() < 5.0 * error + 1e-3).all()


def test_terms_have_one_number_per_episode_even_for_one_episode(variant, batch):
    for count in (1, 16):
        part = [column[:count] for column in batch]
        assert [term.shape for term in variant(*part)] == [(count,)] * 3
        assert variant.elbo(*part).shape == (count,)


def test_an_episode_s_terms_do_not_depend_on_the_others_in_its_batch(variant, batch):
    with torch.no_grad():
        whole = variant(*batch).kl
        alone = torch.cat([variant(*(column[i : i + 1] for column in batch)).kl for i in range(16)])
    torch.testing.assert_close(whole, alone, rtol=1e-4, atol=1e-4)


def test_every_parameter_gets_a_gradient_from_the_bound(variant, batch):
    variant.elbo(*batch).sum().backward()
    without = [name for name, value in variant.named_parameters() if value.grad is None]
    assert without == []


def test_latent_means_are_flat_and_badness_stays_in_the_unit_interval(variant, batch):
    tau, y = variant.latent_means(batch.x)
    assert tau.shape == (16, 9)
    assert y.shape == (16,)
    assert ((y > 0.0) & (y < 1.0)).all()


def test_generated_and_reconstructed_trajectories_have_the_shape_of_the_data(variant, batch):
    assert variant.generate(batch.x).shape == batch.xi.shape
    assert variant.reconstruct(batch.xi, batch.bad, batch.y).shape == batch.xi.shape


def test_controllers_far_from_the_training_data_give_a_finite_bound(variant, batch):
    far = variant.elbo(1e3 * batch.x, 1e3 * batch.xi, batch.bad, batch.y)
    assert torch.isfinite(far).all()


def test_identical_calls_in_evaluation_mode_agree_to_the_bit(model, batch):
    model.eval()
    first, second = model.latent_means(batch.x), model.latent_means(batch.x)
    assert all(torch.equal(a, b) for a, b in zip(first, second, strict=True))


def test_an_initialised_model_decodes_near_the_median(model):
    decoded = model.p_xi(torch.zeros(1, 9)).loc[0]
    residual = (decoded - model.normaliser.median).abs() / model.normaliser.spread
    assert residual.mean() < 0.5


def test_the_seed_determines_the_weights_and_leaves_torch_s_generator_alone(small_config, halves, bounds):
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    first, second, other = (initialised(small_config, halves[0], bounds, seed) for seed in (3, 3, 4))
    assert torch.equal(torch.rand(1), expected)
    for name, value in first.state_dict().items():
        assert torch.equal(value, second.state_dict()[name]), name
    assert not torch.equal(first.badness.output.weight, other.badness.output.weight)


def test_episodes_of_other_sizes_are_refused_with_both(small_config, halves, bounds):
    with pytest.raises(ValueError, match=r"x \(7,\).*got \(6,\).*training stride"):
        initialised(replace(small_config, controller_dim=7), halves[0], bounds, seed=0)


@pytest.mark.parametrize("prior", ["mlp", "deconv"])
def test_longer_paths_widen_the_latent_code(prior):
    model = SvaeDc(ModelConfig(6, 5, 40, path_length=5, tau_dim=6, psi_dim=2, prior=prior))
    tau, psi = model.split(model.prior(torch.rand(2, 6)).loc)
    assert tau.shape == (2, 30)
    assert psi.shape == (2, 10)


def test_bad_steps_and_y_reach_the_posterior(model, batch):
    loc = model.posterior(batch.xi, batch.bad, batch.y).loc
    assert not torch.equal(loc, model.posterior(batch.xi, 1.0 - batch.bad, batch.y).loc)
    assert not torch.equal(loc, model.posterior(batch.xi, batch.bad, 1.0 - batch.y).loc)


def test_few_training_episodes_still_initialise_a_model(small_config, halves, bounds):
    few = replace(halves[0], rows=np.arange(3))
    model = initialised(small_config, few, bounds, seed=0)
    assert all(torch.isfinite(value).all() for value in model.state_dict().values())
