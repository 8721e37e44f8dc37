"""Densities, draws and divergences against torch.distributions, numerical integration and limits."""

import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from svaedc.model.distributions import (
    FAMILIES,
    DiagonalGaussian,
    DiagonalLaplace,
    bounded_scale,
    kl_divergence,
    summed_over_event,
)

TORCH = {"laplace": torch.distributions.Laplace, "gaussian": torch.distributions.Normal}
locations = st.floats(-5.0, 5.0)
log_scales = st.floats(-2.0, 2.0)
families = pytest.mark.parametrize("family", sorted(FAMILIES))


def one(family: str, loc: float, scale: float):
    return FAMILIES[family](torch.tensor([[loc]]).double(), torch.tensor([[scale]]).double())


def random_pair(family: str):
    generator = torch.Generator().manual_seed(3)
    draws = torch.randn(4, 7, 2, 3, generator=generator, dtype=torch.float64)
    return FAMILIES[family](draws[0], draws[1].exp()), FAMILIES[family](draws[2], draws[3].exp())


@families
def test_log_prob_is_the_sum_over_the_event_of_torchs(family):
    q, p = random_pair(family)
    expected = TORCH[family](q.loc, q.scale).log_prob(p.loc).sum((1, 2))
    torch.testing.assert_close(q.log_prob(p.loc), expected)


@families
def test_quantile_is_that_of_torch_row_by_row(family):
    q, _ = random_pair(family)
    u = torch.tensor([[0.01, 0.25, 0.5], [0.6, 0.9, 0.999]], dtype=torch.float64)
    expected = torch.stack(
        [TORCH[family](loc, scale).icdf(u) for loc, scale in zip(q.loc, q.scale, strict=True)]
    )
    torch.testing.assert_close(q.quantile(u), expected)


@families
def test_log_prob_of_another_shape_is_refused_instead_of_broadcast(family):
    q, _ = random_pair(family)
    with pytest.raises(ValueError, match=r"shape \(7, 2, 3\), got \(7, 2\)"):
        q.log_prob(torch.zeros(7, 2, dtype=torch.float64))


@families
@given(locations, log_scales, locations, log_scales)
def test_kl_is_the_integral_of_q_times_the_log_ratio(family, loc_q, log_scale_q, loc_p, log_scale_p):
    q, p = one(family, loc_q, math.exp(log_scale_q)), one(family, loc_p, math.exp(log_scale_p))
    # The grid has a point at q's kink, and reaches so far that q's tails hold less than 1e-15.
    steps = torch.linspace(-40.0, 40.0, 40_001, dtype=torch.float64) * math.exp(log_scale_q)
    values = (loc_q + steps).unsqueeze(-1)
    log_q = TORCH[family](q.loc[0], q.scale[0]).log_prob(values).squeeze()
    log_p = TORCH[family](p.loc[0], p.scale[0]).log_prob(values).squeeze()
    integral = torch.trapezoid(log_q.exp() * (log_q - log_p), steps)
    torch.testing.assert_close(kl_divergence(q, p)[0], integral, rtol=1e-4, atol=1e-5)


@families
def test_kl_agrees_with_torchs_in_this_direction_and_not_in_the_other(family):
    q, p = random_pair(family)
    forward = torch.distributions.kl_divergence(TORCH[family](q.loc, q.scale), TORCH[family](p.loc, p.scale))
    torch.testing.assert_close(kl_divergence(q, p), forward.sum((1, 2)))
    assert not torch.allclose(kl_divergence(p, q), forward.sum((1, 2)))


@families
@given(locations, log_scales, locations, log_scales)
def test_kl_is_never_negative_and_zero_only_between_equals(family, loc_q, log_scale_q, loc_p, log_scale_p):
    q, p = one(family, loc_q, math.exp(log_scale_q)), one(family, loc_p, math.exp(log_scale_p))
    assert kl_divergence(q, p).item() >= -1e-12
    assert kl_divergence(q, q).item() == pytest.approx(0.0, abs=1e-12)


@families
def test_entropy_is_torchs_summed_over_the_event(family):
    q, _ = random_pair(family)
    torch.testing.assert_close(q.entropy(), TORCH[family](q.loc, q.scale).entropy().sum((1, 2)))


def test_kl_between_families_is_refused():
    q, p = one("laplace", 0.0, 1.0), one("gaussian", 0.0, 1.0)
    with pytest.raises(TypeError, match="DiagonalLaplace, DiagonalGaussian"):
        kl_divergence(q, p)


def test_kl_between_shapes_is_refused():
    narrow, wide = torch.ones(2, 1), torch.ones(2, 3)
    with pytest.raises(ValueError, match=r"\(2, 1\) and \(2, 3\)"):
        kl_divergence(DiagonalLaplace(narrow, narrow), DiagonalLaplace(wide, wide))


@families
def test_draws_have_the_family_s_own_moments(family):
    torch.manual_seed(0)
    q = FAMILIES[family](torch.full((200_000, 1), 2.0), torch.full((200_000, 1), 0.5))
    draws = q.rsample()
    excess_kurtosis = ((draws - 2.0) / draws.std()).pow(4).mean() - 3.0
    assert draws.mean().item() == pytest.approx(2.0, abs=0.01)
    assert draws.var().item() == pytest.approx(q.variance[0].item(), rel=0.03)
    assert excess_kurtosis.item() == pytest.approx({"laplace": 3.0, "gaussian": 0.0}[family], abs=0.4)


@families
def test_gradients_flow_through_a_draw_into_location_and_scale(family):
    torch.manual_seed(0)
    loc, scale = torch.zeros(5, 2, requires_grad=True), torch.ones(5, 2, requires_grad=True)
    draw = FAMILIES[family](loc, scale).rsample()
    draw.sum().backward()
    torch.testing.assert_close(loc.grad, torch.ones(5, 2))
    torch.testing.assert_close(scale.grad, draw.detach())


@given(st.floats(-1e6, 1e6))
def test_a_bounded_scale_stays_within_its_bounds(raw):
    scale = bounded_scale(torch.tensor([raw]), 0.1, 10.0).item()
    assert 0.1 * (1.0 - 1e-6) <= scale <= 10.0 * (1.0 + 1e-6)


def test_a_bounded_scale_starts_at_the_geometric_mean_with_unit_slope_of_its_logarithm():
    raw = torch.zeros(1, requires_grad=True)
    scale = bounded_scale(raw, 0.01, 1.0)
    scale.log().backward()
    assert scale.item() == pytest.approx(0.1)
    assert raw.grad.item() == pytest.approx(1.0)


def test_a_bounded_scale_keeps_a_gradient_where_a_clamp_has_none():
    raw = torch.tensor([-4.0], requires_grad=True)
    bounded_scale(raw, 0.1, 10.0).backward()
    assert raw.grad.item() > 1e-3


def test_a_batch_of_scalars_is_its_own_sum():
    values = torch.tensor([1.0, 2.0])
    torch.testing.assert_close(summed_over_event(values), values)


def test_variances_are_those_of_the_families():
    loc, scale = torch.zeros(1, 1), torch.full((1, 1), 3.0)
    assert DiagonalLaplace(loc, scale).variance.item() == 18.0
    assert DiagonalGaussian(loc, scale).variance.item() == 9.0
