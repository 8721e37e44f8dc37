import math

import pytest
import torch

from svaedc.bo.features import Latents, Sigmoid, Whitened, svae, svae_dc
from tests.svaedc.bo.fake_latents import latent_means


def latents(count=50, dimensions=4):
    x = torch.rand(count, dimensions, generator=torch.Generator().manual_seed(0))
    return Latents.of(x, latent_means), x


def test_compression_is_the_formula_element_by_element():
    means, _ = latents()
    expected = [
        [(1 - y) * t for t in row] for row, y in zip(means.tau.tolist(), means.y.tolist(), strict=True)
    ]
    torch.testing.assert_close(svae_dc(means.tau, means.y), torch.tensor(expected, dtype=torch.float64))


def test_controllers_without_badness_are_not_compressed():
    means, _ = latents()
    torch.testing.assert_close(svae_dc(means.tau, torch.zeros_like(means.y)), svae(means.tau, means.y))


def test_sigmoid_compression_is_the_formula_and_one_half_at_its_midpoint():
    means, _ = latents()
    factors = [1 / (1 + math.exp(-12 * ((1 - y) - 0.6))) for y in means.y.tolist()]
    expected = torch.tensor(factors, dtype=torch.float64)[:, None] * means.tau
    torch.testing.assert_close(Sigmoid(alpha=12.0, c=0.6)(means.tau, means.y), expected)
    midpoint = torch.full_like(means.y, 1 - 0.6)
    torch.testing.assert_close(Sigmoid(12.0, 0.6)(means.tau, midpoint), means.tau / 2)


def test_sigmoid_that_would_enlarge_what_is_bad_is_refused():
    with pytest.raises(ValueError, match=r"alpha must be above 0, got -25\.0"):
        Sigmoid(alpha=-25.0)


def test_entirely_bad_controllers_coincide():
    means, _ = latents()
    assert torch.pdist(svae_dc(means.tau, torch.ones_like(means.y))).max() == 0


def test_whitening_gives_every_live_dimension_unit_spread_where_nothing_is_bad():
    means, _ = latents()
    phi = Whitened.over(means.tau)(means.tau, torch.zeros_like(means.y))
    torch.testing.assert_close(phi.std(dim=0), torch.ones(3, dtype=torch.float64))


def test_whitened_paths_are_compressed_as_others_are():
    means, _ = latents()
    phi = Whitened.over(means.tau)(means.tau, means.y)
    torch.testing.assert_close(phi, svae_dc(means.tau, means.y) / means.tau.std(dim=0))


def test_whitening_does_not_blow_up_a_collapsed_dimension():
    means, _ = latents()
    tau = means.tau.clone()
    tau[:, 1] *= 1e-6
    phi = Whitened.over(tau)(tau, means.y)
    assert phi[:, 1].std() < 1e-3


def test_whitening_survives_a_model_that_says_one_thing_of_all():
    tau, y = torch.ones(5, 3).double(), torch.full((5,), 0.4).double()
    assert torch.isfinite(Whitened.over(tau)(tau, y)).all()


def test_cached_latents_are_those_of_the_model_in_float64():
    means, x = latents()
    tau, y = means.means(x)
    assert tau.dtype == y.dtype == torch.float64
    torch.testing.assert_close(means.tau, tau)
    torch.testing.assert_close(means.y, y)


def test_latents_carry_no_gradient():
    weight = torch.ones(4, 3, requires_grad=True)
    means = Latents.of(torch.rand(5, 4), lambda x: (x @ weight, x[:, 0]))
    assert not means.tau.requires_grad


def test_badness_that_overshoots_is_clamped_so_that_no_path_is_mirrored():
    means = Latents.of(torch.rand(2, 4), lambda x: (x, torch.tensor([-0.1, 1.1])))
    assert means.y.tolist() == [0.0, 1.0]


def test_latents_of_a_diverged_model_are_refused():
    with pytest.raises(ValueError, match="diverged"):
        Latents.of(torch.rand(2, 4), lambda x: (x * torch.nan, x[:, 0]))
    with pytest.raises(ValueError, match=r"y must lie in \[0, 1\]"):
        Latents.of(torch.rand(2, 4), lambda x: (x, x[:, 0] * torch.nan))
