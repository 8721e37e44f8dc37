import math

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from svaedc import kernels
from svaedc.features import svae_dc
from tests.svaedc.fake_latents import latent_means

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
    x = points(7, 5)
    lengthscales = [0.3, 0.8, 1.4]
    kernel = kernels.SvaeDc(with_lengthscales(kernels.se(3), lengthscales), latent_means)
    tau, y = latent_means(x)
    phi = torch.stack([(1 - b) * t for t, b in zip(tau, y, strict=True)])
    torch.testing.assert_close(kernel(x).to_dense(), brute_force(se_profile, phi, phi, lengthscales))


@pytest.mark.parametrize("kernel", KERNELS)
def test_svae_dc_on_controllers_equals_the_outer_kernel_on_cached_features(kernel):
    x = points(9, 4)
    outer = kernel(3).double()
    torch.testing.assert_close(
        kernels.SvaeDc(outer, latent_means)(x).to_dense(), outer(svae_dc(*latent_means(x))).to_dense()
    )


@pytest.mark.parametrize("kernel", KERNELS)
def test_entirely_bad_controllers_are_alike_to_the_kernel(kernel):
    outer = kernel(3).double()
    same = kernels.SvaeDc(outer, lambda x: (latent_means(x)[0], torch.ones(len(x)).double()))
    matrix = same(points(8, 4)).to_dense()
    torch.testing.assert_close(matrix, torch.full_like(matrix, outer.outputscale.item()))


def test_svae_dc_predicts_batches_and_diagonals_like_single_matrices():
    x = points(12, 4).reshape(3, 4, 4)
    kernel = kernels.SvaeDc(kernels.se(3).double(), latent_means)
    each = torch.stack([kernel(part).to_dense() for part in x])
    torch.testing.assert_close(kernel(x).to_dense(), each)
    torch.testing.assert_close(kernel(x, diag=True), each.diagonal(dim1=-2, dim2=-1))


def test_gradients_of_svae_dc_reach_the_controller():
    x = points(1, 4).requires_grad_()
    kernels.SvaeDc(kernels.se(3).double(), latent_means)(x, points(3, 4, seed=2)).to_dense().sum().backward()
    assert x.grad is not None
    assert x.grad.abs().min() > 0


def test_frozen_model_is_no_part_of_the_kernel():
    network = torch.nn.Linear(4, 3).double()
    kernel = kernels.SvaeDc(kernels.se(3), lambda x: (network(x), x[:, 0]))
    held = {id(parameter) for parameter in kernel.parameters()}
    assert held
    assert not held & {id(parameter) for parameter in network.parameters()}


@settings(deadline=None, max_examples=40)
@given(
    kernel=st.sampled_from(KERNELS),
    count=st.integers(1, 15),
    seed=st.integers(0, 10_000),
    lengthscale=st.floats(*kernels.LENGTHSCALE, exclude_min=True, exclude_max=True),
)
def test_every_kernel_matrix_is_symmetric_and_positive_semi_definite(kernel, count, seed, lengthscale):
    outer = with_lengthscales(kernel(1), [lengthscale])
    matrix = kernels.SvaeDc(outer, latent_means)(points(count, 4, seed)).to_dense().detach()
    torch.testing.assert_close(matrix, matrix.T)
    assert torch.linalg.eigvalsh(matrix).min() > -1e-9 * count


def test_kernel_without_lengthscales_is_refused():
    with pytest.raises(ValueError, match="at least 1 lengthscale, got 0"):
        kernels.se(0)
