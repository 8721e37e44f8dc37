import numpy as np
import pytest
import torch

from svaedc.bo.acquisition import ByGradient, OverPool, torch_randomness
from svaedc.bo.candidates import as_they_are, by_latents
from svaedc.bo.features import svae_dc
from svaedc.bo.history import History
from tests.svaedc.bo.fake_latents import problem

NOTHING = History.empty(2)


def rng(seed=0):
    return np.random.default_rng(seed)


def peak_at(candidates, x):
    top = candidates.features_of(torch.tensor([x], dtype=torch.float64))
    return lambda phi: -(phi - top).square().sum(dim=-1)


def test_gradients_find_the_peak_and_the_pool_its_nearest_candidate():
    candidates, top = as_they_are(problem(2, 300, 0)), [0.23, 0.81]
    value = peak_at(candidates, top)
    assert ByGradient().maximize(value, candidates, NOTHING, rng()).tolist() == pytest.approx(top, abs=1e-3)
    nearest = candidates.x[((candidates.x - top) ** 2).sum(axis=1).argmin()]
    np.testing.assert_array_equal(OverPool().maximize(value, candidates, NOTHING, rng()), nearest)


def test_gradients_go_through_the_model_to_the_controller():
    candidates = by_latents(problem(2, 300, 0), svae_dc)
    value = peak_at(candidates, [0.3, 0.6])
    x = ByGradient().maximize(value, candidates, NOTHING, rng())
    with torch.no_grad():
        assert value(candidates.features_of(torch.tensor(x[None]).double())).item() > -1e-4


def test_search_stays_in_the_box():
    low, high = torch.tensor([0.2, 0.5]).double(), torch.tensor([0.4, 0.6]).double()
    given = as_they_are(problem(2, 50, 0))
    box = given.within(low, high)
    for search in (OverPool(), ByGradient()):
        for x in (
            search.maximize(peak_at(box, [0.9, 0.9]), box, NOTHING, rng()),
            search.anywhere(box, NOTHING, rng()),
        ):
            assert (x >= low.numpy() - 1e-6).all()
            assert (x <= high.numpy() + 1e-6).all()
    torch.testing.assert_close(box.phi, given.features_of(torch.tensor(box.x).double()))


def test_gradients_stop_at_controllers_predicted_too_bad():
    # The fake badness rises with x_0, and so does this acquisition.
    screened = as_they_are(problem(2, 300, 0).least_bad(0.3))
    worst_kept = screened.x[:, 0].max()
    for x in (
        ByGradient().maximize(peak_at(screened, [0.9, 0.5]), screened, NOTHING, rng()),
        *(ByGradient().anywhere(screened, NOTHING, rng(seed)) for seed in range(20)),
    ):
        assert x[0] < worst_kept + 0.02


def test_controller_found_again_gives_way_to_a_random_one():
    candidates = as_they_are(problem(2, 50, 0))
    value = peak_at(candidates, [2.0, 2.0])
    corner = ByGradient().maximize(value, candidates, NOTHING, rng())
    assert corner.tolist() == [1.0, 1.0]
    for history in (NOTHING.append(corner, 0.5), NOTHING.append(corner, float("nan"))):
        assert not np.array_equal(ByGradient().maximize(value, candidates, history, rng()), corner)


def test_flat_acquisition_is_no_reason_to_stop():
    candidates = as_they_are(problem(2, 50, 0))
    x = ByGradient().maximize(lambda phi: 0 * phi.sum(dim=-1), candidates, NOTHING, rng())
    assert ((x >= 0) & (x <= 1)).all()


def test_torch_draws_from_the_generator_and_its_global_state_is_left_alone():
    torch.manual_seed(1)
    untouched = torch.rand(3)
    torch.manual_seed(1)
    with torch_randomness(np.random.default_rng(7)):
        first = torch.rand(3)
    torch.testing.assert_close(torch.rand(3), untouched)
    with torch_randomness(np.random.default_rng(7)):
        torch.testing.assert_close(torch.rand(3), first)
    with torch_randomness(np.random.default_rng(8)):
        assert not torch.equal(torch.rand(3), first)
