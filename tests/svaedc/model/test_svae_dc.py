"""The bound against its sampled form, shapes, and what a model promises to the kernels."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
import torch

from svaedc.model.config import ModelConfig, ScaleBounds
from svaedc.model.svae_dc import SvaeDc, initialized_model

FAST = (("laplace", "low-rank", "deconv"), ("gaussian", "dense", "mlp"))  # each choice once
VARIANTS = [
    pytest.param(
        {"distribution": distribution, "head": head, "prior": prior, "trunk": prior},
        id=f"{distribution}-{head}-{prior}",
        marks=[] if (distribution, head, prior) in FAST else pytest.mark.slow,
    )
    for distribution, head, prior in product(
        ("laplace", "gaussian"), ("low-rank", "dense"), ("mlp", "deconv")
    )
]


@pytest.fixture(params=VARIANTS)
def variant(request, small_config, halves, bounds):
    return initialized_model(replace(small_config, **request.param), halves[0], bounds, seed=1).eval()


def test_the_bound_is_the_mean_of_its_sampled_four_term_form(variant, batch):
    """E_q[log p(xi|tau) + log p(y|psi) + log p(tau,psi|x) - log q(tau,psi|xi,y)] by brute force."""
    torch.manual_seed(0)
    with torch.no_grad():
        q, p = variant.posterior(batch.xi, batch.bad, batch.y), variant.prior(batch.x)
        xi = variant.normaliser.normalize(batch.xi)
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


def test_generation_terms_are_those_of_the_prior_s_means(variant, batch):
    with torch.no_grad():
        log_p_xi, log_p_y = variant.generation_terms(variant.prior(batch.x), batch.xi, batch.y)
        generated = variant.generate(batch.x)
        tau, psi = variant.split(variant.prior(batch.x).loc)
        scaled = variant.normaliser.normalize(generated)
        peak = variant.p_xi(tau).log_prob(scaled)
    assert log_p_xi.shape == log_p_y.shape == (16,)
    assert (log_p_xi < peak).all()
    torch.testing.assert_close(log_p_y, variant.p_y(psi).log_prob(batch.y))


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


def test_an_initialized_model_decodes_near_the_median(model):
    decoded = model.p_xi(torch.zeros(1, 9)).loc[0]
    residual = (decoded - model.normaliser.median).abs() / model.normaliser.spread
    assert residual.mean() < 0.5


def test_the_seed_determines_the_weights_and_leaves_torch_s_generator_alone(small_config, halves, bounds):
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    first, second, other = (initialized_model(small_config, halves[0], bounds, seed) for seed in (3, 3, 4))
    assert torch.equal(torch.rand(1), expected)
    for name, value in first.state_dict().items():
        assert torch.equal(value, second.state_dict()[name]), name
    assert not torch.equal(first.badness.output.weight, other.badness.output.weight)


def test_episodes_of_other_sizes_are_refused_with_both(small_config, halves, bounds):
    with pytest.raises(ValueError, match=r"x \(7,\).*got \(6,\).*training stride"):
        initialized_model(replace(small_config, controller_dim=7), halves[0], bounds, seed=0)


@pytest.fixture(params=["laplace", "gaussian"])
def tiny(request, episodes, bounds):
    """One step of one latent dimension each: small enough to integrate over; in double precision."""
    config = ModelConfig(
        *(6, 5, 40),
        path_length=1,
        tau_dim=1,
        distribution=request.param,
        channels=(8, 16),
        rank=4,
        prior_hidden=(16,),
        badness_hidden=(8,),
        latent_scale=ScaleBounds(0.2, 2.0),
    )
    return initialized_model(config, episodes, bounds, seed=0).double().eval()


def test_the_bound_and_its_gap_to_the_evidence_are_those_of_numerical_integration(tiny, batch):
    """ELBO = E_q[...] on a grid, and log p(xi,y|x) - ELBO = KL(q || p(tau,psi|xi,y,x)), never negative."""
    one = [column[:1].double() for column in batch]
    axis = torch.linspace(-12.0, 12.0, 601, dtype=torch.float64)
    area = (axis[1] - axis[0]).square()
    grid = torch.cartesian_prod(axis, axis)
    with torch.no_grad():
        q, p = tiny.posterior(*one[1:]), tiny.prior(one[0])
        log_q, log_p = (over(each, grid) for each in (q, p))
        xi = tiny.normaliser.normalize(one[1]).expand(len(axis), -1, -1)
        log_p_xi = tiny.p_xi(axis[:, None]).log_prob(xi).repeat_interleave(len(axis))
        log_p_y = tiny.p_y(axis[:, None]).log_prob(one[3].expand(len(axis))).repeat(len(axis))
        joint = log_p_xi + log_p_y + log_p
        # The sum over a grid is a little off at a Laplace's kink, for q's integral as for the others.
        weight = log_q.softmax(0)
        bound = (weight * (joint - log_q)).sum()
        evidence = torch.logsumexp(joint, 0) + area.log()
        gap = (weight * (log_q - (joint - evidence))).sum()
        torch.manual_seed(0)
        draws = tiny.elbo(*(column.expand(4_000, *column.shape[1:]) for column in one))
    spread = draws.std() / draws.numel() ** 0.5
    assert bound.item() == pytest.approx(draws.mean().item(), abs=5.0 * spread.item() + 1e-2)
    assert gap.item() == pytest.approx((evidence - bound).item(), rel=1e-3, abs=1e-3)
    assert gap.item() > 0.0
    assert (log_q.exp().sum() * area).item() == pytest.approx(1.0, rel=2e-3)


def over(distribution, grid):
    """Log density of one episode's latent code at every point of a grid."""
    loc, scale = (each.expand(len(grid), -1) for each in (distribution.loc, distribution.scale))
    return type(distribution)(loc, scale).log_prob(grid)


@pytest.fixture(params=["low-rank", "dense"])
def svae(request, small_config, halves, bounds):
    return initialized_model(
        replace(small_config, psi_dim=0, head=request.param), halves[0], bounds, seed=1
    ).eval()


def test_the_svae_s_bound_is_the_three_term_one_and_knows_nothing_of_badness(svae, batch):
    """Equation (elbo_simple): E_q[log p(xi|tau) + log p(tau|x) - log q(tau|xi)]."""
    torch.manual_seed(0)
    with torch.no_grad():
        q, p = svae.posterior(batch.xi, batch.bad, batch.y), svae.prior(batch.x)
        xi = svae.normaliser.normalize(batch.xi)
        codes = [q.rsample() for _ in range(150)]
        sampled = torch.stack(
            [svae.p_xi(code).log_prob(xi) + p.log_prob(code) - q.log_prob(code) for code in codes]
        )
        closed = torch.stack([svae.elbo(*batch) for _ in range(150)])
        flipped = svae.posterior(batch.xi, 1.0 - batch.bad, 1.0 - batch.y)
    assert q.loc.shape == (16, 9)
    assert torch.equal(q.loc, flipped.loc)
    error = (sampled.var(0) + closed.var(0)).sqrt() / 150**0.5
    assert ((sampled.mean(0) - closed.mean(0)).abs() < 5.0 * error + 1e-3).all()


def test_every_parameter_of_the_svae_gets_a_gradient_and_none_belongs_to_badness(svae, batch):
    svae.elbo(*batch).sum().backward()
    assert [name for name, value in svae.named_parameters() if value.grad is None] == []
    assert not any("badness" in name for name in svae.state_dict())


def test_the_svae_predicts_no_badness_and_says_so_when_asked_for_its_density(svae, batch):
    assert torch.equal(svae.latent_means(batch.x)[1], torch.zeros(16))
    with pytest.raises(TypeError, match="needs a model with psi, got an SVAE"):
        svae.p_y(torch.zeros(1, 0))


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


def test_few_training_episodes_still_initialize_a_model(small_config, halves, bounds):
    few = replace(halves[0], rows=np.arange(3))
    model = initialized_model(small_config, few, bounds, seed=0)
    assert all(torch.isfinite(value).all() for value in model.state_dict().values())
