import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from svaedc.bo import distribution_features

FAMILIES = [
    (distribution_features.gaussian, torch.distributions.Normal),
    (distribution_features.laplace, torch.distributions.Laplace),
]


def rows(count, seed, dimensions=4, far=0.0):
    generator = torch.Generator().manual_seed(seed)
    return far + torch.randn(count, 2 * dimensions, generator=generator, dtype=torch.float64)


@pytest.mark.parametrize(("divergence", "family"), FAMILIES)
def test_divergence_is_that_of_torch_pair_by_pair(divergence, family):
    p, q = rows(5, 0), rows(3, 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            of_a, of_b = (family(row[:4], row[4:].exp()) for row in (a, b))
            exact = torch.distributions.kl_divergence(of_a, of_b).sum()
            torch.testing.assert_close(divergence(p, q)[i, j], exact)


@pytest.mark.parametrize("divergence", [distribution_features.gaussian, distribution_features.laplace])
@given(seed=st.integers(0, 10_000))
def test_divergence_is_never_negative_and_zero_from_itself(divergence, seed):
    p = rows(6, seed)
    matrix = divergence(p, p)
    assert matrix.min() >= 0
    assert matrix.diagonal().max() < 1e-9 * max(1.0, matrix.max().item())


def test_products_lose_no_digits_to_a_common_offset():
    p = rows(4, 0)
    shifted = p.clone()
    shifted[:, :4] += 1e6
    torch.testing.assert_close(
        distribution_features.gaussian(shifted, shifted),
        distribution_features.gaussian(p, p),
        rtol=1e-6,
        atol=1e-6,
    )
