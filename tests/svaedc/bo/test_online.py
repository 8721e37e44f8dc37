import numpy as np
import pytest
import torch
from gpytorch.mlls import ExactMarginalLogLikelihood

from svaedc.bo import gp, kernels, methods
from svaedc.bo.features import Sigmoid
from svaedc.bo.history import History
from svaedc.bo.online import LAST_LAYERS, Adjustable, AdjustedPaths
from tests.svaedc.bo.fake_latents import FakeModel, latent_means, problem

FAKE = Adjustable(FakeModel(), layers=("last.weight",))


def x(count=12, dimensions=4):
    return torch.rand(count, dimensions, generator=torch.Generator().manual_seed(0), dtype=torch.float64)


def kernel(adjustable=FAKE, dimensions=3):
    return kernels.Embedded(
        kernels.se(dimensions), AdjustedPaths(adjustable, 0.5, Sigmoid(5.0, 0.5))
    ).double()


def test_features_are_those_of_the_trained_model_before_any_trial():
    tau, y = latent_means(x())
    expected = Sigmoid(5.0, 0.5)(tau, y) / 0.5
    torch.testing.assert_close(kernel().phi(x()), expected, rtol=1e-5, atol=1e-5)


def test_real_model_has_the_layers_that_are_adjusted(model, episodes):
    model = model.eval()
    assert set(LAST_LAYERS) <= dict(model.named_parameters()).keys()
    at = torch.tensor(episodes.x[:5]).double()
    adjusted = AdjustedPaths(Adjustable(model), 1.0, Sigmoid())
    tau, y = model.latent_means(at.float())
    torch.testing.assert_close(adjusted(at), Sigmoid()(tau.double(), y.double()), rtol=1e-4, atol=1e-5)
    adjusted(at).square().sum().backward()
    moved = {name for name, offset in adjusted.named_parameters() if offset.grad.abs().max() > 0}
    assert moved == dict(adjusted.named_parameters()).keys()


def test_fit_adjusts_alpha_c_and_the_last_layer_and_raises_the_posterior_density():
    # f depends on a direction of tau that the trained features hardly show.
    f = (0.5 + latent_means(x(20))[0] @ torch.tensor([0.0, 0.0, 0.4], dtype=torch.float64)).clamp(0, 1)

    def density(make):
        process = gp.fit(make, x(20), f).model
        process.train()
        return ExactMarginalLogLikelihood(process.likelihood, process)(process(x(20)), f).item()

    def held():
        made = kernel()
        made.phi.requires_grad_(requires_grad=False)
        return made

    fitted = gp.fit(kernel, x(20), f).model.covar_module.phi
    assert all(offset.abs().max() > 1e-4 for offset in fitted.parameters())
    assert density(kernel) > density(held)


def test_fit_leaves_the_trained_model_as_it_was(model, episodes):
    model = model.eval()
    before = {name: value.clone() for name, value in model.state_dict().items()}
    at, f = torch.tensor(episodes.x[:6]).double(), torch.linspace(0, 1, 6).double()
    gp.fit(lambda: kernel(Adjustable(model), model.config.tau_size), at, f)
    for name, value in model.state_dict().items():
        assert torch.equal(value, before[name])
        assert value.dtype == before[name].dtype


def test_few_trials_move_no_weight_by_more_than_one_standard_deviation_of_its_prior():
    f = torch.full((8,), 0.5, dtype=torch.float64)
    fitted = gp.fit(kernel, x(8), f).model.covar_module.phi
    assert max(offset.abs().max().item() for offset in fitted.parameters()) < 1


def test_online_method_is_the_sigmoid_method_until_trials_adjust_it():
    given = problem(4, 60, 0)
    history = History.empty(4).append(given.pool[0], 0.3)
    online, fixed = (methods.build(name, given) for name in ("svae-dc-online", "svae-dc-sigmoid"))
    np.testing.assert_array_equal(
        online.suggest(history, np.random.default_rng(0)), fixed.suggest(history, np.random.default_rng(0))
    )


@pytest.mark.parametrize("batch", [(), (2,), (2, 3)])
def test_features_of_batches_are_those_of_single_controllers(batch):
    at = x(12).reshape(*batch, -1, 4)
    phi = kernel().phi
    torch.testing.assert_close(phi(at).reshape(12, 3), phi(x(12)))
