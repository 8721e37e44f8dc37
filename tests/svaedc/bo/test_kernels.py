import math

import pytest
import torch

from svaedc.bo import distribution_features, kernels
from svaedc.bo.features import svae_dc
from tests.svaedc.bo.fake_latents import latent_means

KERNELS = [kernels.se, kernels.matern]


def points(count, dimensions, seed=0):
    return torch.rand(count, dimensions, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def with_lengthscales(kernel, lengthscales, output_scale=0.7):
    kernel = kernel.double()
    kernel.base_kernel.lengthscale = torch.tensor(lengthscales).double()
    kernel.outputscale = output_scale
    return kernel


def brute_force(profile, x1, x2, lengthscales, output_scale=0.7):
    def value(a, b):
        d = math.sqrt(sum(((p - q) / ell) ** 2 for p, q, ell in zip(a, b, lengthscales, strict=True)))
        return output_scale * profile(d)

    return torch.tensor([[value(a, b) for b in x2.tolist()] for a in x1.tolist()], dtype=torch.float64)


def se_profile(d):
    return math.exp(-0.5 * d**2)


def matern_profile(d):
    return (1 + math.sqrt(5) * d + 5 / 3 * d**2) * math.exp(-math.sqrt(5) * d)


@pytest.mark.parametrize(("kernel", "profile"), [(kernels.se, se_profile), (kernels.matern, matern_profile)])
@pytest.mark.parametrize("lengthscales", [[0.6], [0.3, 1.0, 2.5]])
def test_kernel_is_the_formula_pair_by_pair(kernel, profile, lengthscales):
    x1, x2 = points(6, 3), points(4, 3, seed=1)
    ours = with_lengthscales(kernel(len(lengthscales)), lengthscales)(x1, x2).to_dense()
    each = lengthscales if len(lengthscales) == 3 else lengthscales * 3
    torch.testing.assert_close(ours, brute_force(profile, x1, x2, each))


def test_svae_dc_is_the_formula_pair_by_pair():
    lengthscales = [0.3, 0.8, 1.4]
    kernel = kernels.compressed_kernel(with_lengthscales(kernels.se(3), lengthscales), svae_dc)
    tau, y = latent_means(points(7, 5))
    phi = torch.stack([(1 - b) * t for t, b in zip(tau, y, strict=True)])
    rows = torch.cat([tau, y[:, None]], dim=1)
    torch.testing.assert_close(kernel(rows).to_dense(), brute_force(se_profile, phi, phi, lengthscales))


@pytest.mark.parametrize("kernel", KERNELS)
def test_svae_dc_on_latents_equals_the_outer_kernel_on_cached_features(kernel):
    tau, y = latent_means(points(9, 4))
    outer = kernel(3).double()
    whole = kernels.compressed_kernel(outer, svae_dc)(torch.cat([tau, y[:, None]], dim=1))
    torch.testing.assert_close(whole.to_dense(), outer(svae_dc(tau, y)).to_dense())


@pytest.mark.parametrize(
    ("divergence", "family"),
    [
        (distribution_features.gaussian, torch.distributions.Normal),
        (distribution_features.laplace, torch.distributions.Laplace),
    ],
)
def test_kl_kernel_is_the_formula_pair_by_pair(divergence, family):
    x1, x2 = (
        torch.cat([points(n, 4, seed), points(n, 4, seed + 5) - 0.5], dim=1) for n, seed in ((6, 0), (3, 1))
    )
    kernel = kernels.kl(divergence, median=3.0).double()
    kernel.outputscale = 0.7
    kernel.base_kernel.initialize(raw_alpha=torch.tensor(0.4))
    alpha = kernel.base_kernel.alpha.item()

    def kl(a, b):
        p, q = (family(row[:4], row[4:].exp()) for row in (a, b))
        return torch.distributions.kl_divergence(p, q).sum().item()

    def value(a, b):
        return 0.7 * math.exp(-alpha * (math.sqrt(kl(a, b)) + math.sqrt(kl(b, a))))

    expected = torch.tensor([[value(a, b) for b in x2] for a in x1], dtype=torch.float64)
    torch.testing.assert_close(kernel(x1, x2).to_dense(), expected)


def test_alpha_starts_at_the_inverse_of_the_median_distance():
    assert kernels.kl(distribution_features.gaussian, median=4.0).base_kernel.alpha.item() == pytest.approx(
        0.25
    )


def test_kl_kernel_of_gaussians_of_one_scale_is_an_exponential_of_their_distance():
    mu = points(8, 3)
    rows = torch.cat([mu, torch.full_like(mu, math.log(0.2))], dim=1)
    matrix = kernels.kl(distribution_features.gaussian, median=1.0).double()(rows, rows + 0).to_dense()
    expected = 0.5 * torch.exp(-math.sqrt(2) * torch.cdist(mu, mu) / 0.2)
    torch.testing.assert_close(matrix, expected, atol=1e-6, rtol=1e-6)


def test_kernel_without_lengthscales_is_refused():
    with pytest.raises(ValueError, match="at least 1 lengthscale, got 0"):
        kernels.se(0)
