"""What every kernel obeys: shapes, batches, symmetry, definiteness, gradients, state, precision."""

from collections.abc import Callable
from dataclasses import dataclass

import pytest
import torch
from gpytorch.kernels import Kernel

from svaedc.bo import distribution_features, kernels
from svaedc.bo.features import Sigmoid, Whitened, svae, svae_dc

K = 3


@dataclass(frozen=True)
class Case:
    """A kernel and features it is made for."""

    kernel: Callable[[], Kernel]
    features: Callable[[tuple[int, ...], int], torch.Tensor]


def uniform(shape, seed):
    return torch.rand(shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def points(shape, seed):
    return uniform((*shape, K), seed)


def paths_and_badness(shape, seed):
    """Rows [tau | y]."""
    return torch.cat([2 * uniform((*shape, K), seed) - 1, uniform((*shape, 1), seed + 1)], dim=-1)


def distributions(shape, seed):
    """Rows [location | log scale], scales between e^-1 and e^0.5."""
    return torch.cat([2 * uniform((*shape, K), seed) - 1, 1.5 * uniform((*shape, K), seed + 1) - 1], dim=-1)


def compressed(outer, embedding):
    return Case(lambda: kernels.compressed_kernel(outer(K), embedding), paths_and_badness)


WHITENED = Whitened(torch.tensor([0.5, 1.0, 2.0]).double())
COMPRESSED = {
    "svae-dc": compressed(kernels.se, svae_dc),
    "svae-dc-matern": compressed(kernels.matern, svae_dc),
    "svae-dc-sigmoid": compressed(kernels.se, Sigmoid()),
    "svae-dc-whitened": compressed(kernels.se, WHITENED),
}
CASES = {
    "se": Case(lambda: kernels.se(1), points),
    "se-ard": Case(lambda: kernels.se(K), points),
    "matern": Case(lambda: kernels.matern(1), points),
    "matern-ard": Case(lambda: kernels.matern(K), points),
    "svae": compressed(kernels.se, svae),
    "svae-matern": compressed(kernels.matern, svae),
    **COMPRESSED,
    "bbk-kl": Case(lambda: kernels.kl(distribution_features.gaussian, median=2.0), distributions),
    "lkl": Case(lambda: kernels.kl(distribution_features.laplace, median=2.0), distributions),
}
every_kernel = pytest.mark.parametrize("case", CASES.values(), ids=CASES)


def made(case):
    return case.kernel().double()


def dense(kernel, *x):
    return kernel(*x).to_dense().detach()


@every_kernel
@pytest.mark.parametrize(("n", "m"), [(1, 1), (2, 7)])
def test_matrix_has_a_row_and_a_column_for_each_controller(case, n, m):
    matrix = dense(made(case), case.features((n,), 0), case.features((m,), 9))
    assert matrix.shape == (n, m)
    assert torch.isfinite(matrix).all()


@every_kernel
@pytest.mark.parametrize("batch", [(3,), (2, 2)])
def test_batch_is_its_matrices_one_by_one(case, batch):
    kernel, x1, x2 = made(case), case.features((*batch, 4), 0), case.features((*batch, 3), 9)
    for matrix, a, b in zip(
        dense(kernel, x1, x2).flatten(0, -3), x1.flatten(0, -3), x2.flatten(0, -3), strict=True
    ):
        torch.testing.assert_close(matrix, dense(kernel, a, b))
    for matrix, a in zip(dense(kernel, x1).flatten(0, -3), x1.flatten(0, -3), strict=True):
        torch.testing.assert_close(matrix, dense(kernel, a))


@every_kernel
def test_candidates_in_batches_meet_the_same_trials(case):
    kernel, candidates, trials = made(case), case.features((6, 1), 0), case.features((4,), 9)
    torch.testing.assert_close(
        dense(kernel, candidates, trials).squeeze(-2), dense(kernel, candidates.squeeze(-2), trials)
    )


@every_kernel
def test_diagonal_is_the_output_scale(case):
    kernel, x = made(case), case.features((6,), 0)
    scale = kernel.outer.outputscale if isinstance(kernel, kernels.Embedded) else kernel.outputscale
    torch.testing.assert_close(kernel(x, diag=True), scale.expand(6))
    torch.testing.assert_close(
        dense(kernel, x, x.clone() + 1e-12).diagonal(), scale.detach().expand(6), atol=1e-5, rtol=0
    )


@every_kernel
def test_matrix_is_symmetric(case):
    kernel, x, z = made(case), case.features((7,), 0), case.features((4,), 9)
    torch.testing.assert_close(dense(kernel, x), dense(kernel, x).mT, rtol=0, atol=1e-15)
    torch.testing.assert_close(dense(kernel, x, z), dense(kernel, z, x).mT)


@every_kernel
def test_matrix_of_controllers_with_themselves_is_positive_definite_up_to_rounding(case):
    matrices = dense(made(case), case.features((20, 30), 0))
    assert torch.linalg.eigvalsh(matrices).min() > -1e-10


@every_kernel
def test_gradients_with_respect_to_features_are_those_of_finite_differences(case):
    kernel, z = made(case), case.features((2,), 9)
    x = case.features((3,), 0).requires_grad_()
    assert torch.autograd.gradcheck(lambda x: kernel(x, z).to_dense(), x)


@every_kernel
def test_gradients_reach_every_hyper_parameter(case):
    kernel, x = made(case), case.features((5,), 0)
    kernel(x).to_dense().square().sum().backward()
    found = {name: parameter.grad for name, parameter in kernel.named_parameters()}
    assert len(found) >= 2
    assert all(gradient is not None and gradient.abs().max() > 0 for gradient in found.values())


@every_kernel
def test_gradient_is_finite_where_a_controller_meets_itself(case):
    kernel, x = made(case), case.features((3,), 0).requires_grad_()
    kernel(x, x.detach().clone()).to_dense().sum().backward()
    assert torch.isfinite(x.grad).all()


@every_kernel
def test_state_restores_the_kernel(case):
    kernel, other, x = made(case), made(case), case.features((5,), 0)
    with torch.no_grad():
        for parameter in kernel.parameters():
            parameter += 0.7
    assert not torch.allclose(dense(kernel, x), dense(other, x))
    other.load_state_dict(kernel.state_dict())
    torch.testing.assert_close(dense(kernel, x), dense(other, x), rtol=0, atol=0)


@every_kernel
def test_float64_stays_float64(case):
    assert dense(made(case), case.features((4,), 0)).dtype == torch.float64


@pytest.mark.parametrize("case", COMPRESSED.values(), ids=COMPRESSED)
def test_controllers_coincide_in_the_limit_of_entire_badness(case):
    kernel, x = made(case), case.features((6,), 0)

    def spread(y):
        x[:, -1] = y
        matrix = dense(kernel, x)
        return (matrix.max() - matrix.min()).item()

    spreads = [spread(y) for y in (0.0, 0.5, 0.9, 0.99, 1.0)]
    assert spreads == sorted(spreads, reverse=True)
    assert spreads[0] > 0.05
    assert spreads[-1] < 1e-6


@pytest.mark.parametrize("case", COMPRESSED.values(), ids=COMPRESSED)
def test_bad_controllers_are_closer_to_each_other_than_good_ones(case):
    kernel, x = made(case), case.features((6,), 0)
    x[:3, -1], x[3:, -1] = 0.05, 0.95
    x[3:, :-1] = x[:3, :-1]
    matrix = dense(kernel, x)
    off_diagonal = ~torch.eye(3, dtype=torch.bool)
    assert matrix[3:, 3:][off_diagonal].min() > matrix[:3, :3][off_diagonal].max()


@pytest.mark.parametrize("name", ["bbk-kl", "lkl"])
def test_kl_kernel_needs_its_jitter_and_takes_no_more_than_it_needs(name):
    case = CASES[name]
    kernel = kernels.SymmetrizedKl(case.kernel().base_kernel.divergence, median=30.0).double()
    lifted = 0
    for seed in range(5):
        # Scales that differ by orders of magnitude are what breaks definiteness.
        x = case.features((40,), seed) * torch.tensor([1.0, 1, 1, 6, 6, 6]).double()
        bare = torch.exp(-kernel.alpha * kernels.distance(kernel.divergence, x, x)).detach()
        smallest = torch.linalg.eigvalsh(bare).min().item()
        jitter = dense(kernel, x).diagonal() - 1
        torch.testing.assert_close(
            jitter, torch.full_like(jitter, max(0.0, kernels.JITTER - smallest)), atol=1e-6, rtol=0
        )
        lifted += smallest < 0
    assert lifted > 0
