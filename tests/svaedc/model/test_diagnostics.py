"""Diagnostics against models whose answers are known."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from svaedc.model.diagnostics import collapse, evaluate
from svaedc.model.svae_dc import initialized_model

GOOD = {"active_share": 1.0, "rec_norm": 0.5, "gen_norm": 0.6, "corr_y_rec": 0.99, "mae_y_rec": 0.01}
ABOUT_Y = ("corr_y_rec", "mae_y_rec")


@pytest.fixture
def median_only(model):
    """A model whose decoder ignores the latent path and returns the per-step median."""
    torch.nn.init.zeros_(model.decoder.coefficients.weight)
    torch.nn.init.zeros_(model.decoder.coefficients.bias)
    return model


def test_a_decoder_of_the_median_scores_exactly_one(median_only, halves):
    metrics = evaluate(median_only, halves[1])
    assert [metrics[name] for name in ("rec_norm", "rec_raw", "gen_norm", "gen_raw")] == [1.0] * 4


def test_a_prior_that_ignores_the_controller_has_no_active_dimension(model, halves):
    torch.nn.init.zeros_(model.prior_network.latent.linear.weight)
    metrics = evaluate(model, halves[1])
    assert metrics["active_dimensions"] == 0.0
    assert metrics["active_share"] == 0.0
    assert metrics["corr_y_gen"] == 0.0


def test_a_dimension_counts_as_active_by_its_spread_relative_to_the_posterior(model, halves):
    with torch.no_grad():
        linear = model.prior_network.latent.linear
        linear.weight[3] = 0.0
        linear.weight[:9] *= 1e3
    assert evaluate(model, halves[1])["active_dimensions"] == 8.0


def test_relative_errors_are_those_of_plain_loops(model, halves):
    held_out = halves[1]
    with torch.no_grad():
        generated = model.eval().generate(torch.from_numpy(held_out.x[held_out.rows])).numpy()
    truth = held_out.xi[held_out.rows]
    median = model.normaliser.denormalize(model.normaliser.median[None])[0].numpy()
    ratios = [
        np.abs(generated[:, d] - truth[:, d]).mean() / np.abs(median[d] - truth[:, d]).mean()
        for d in range(5)
    ]
    metrics = evaluate(model, held_out)
    assert metrics["gen_norm"] == pytest.approx(np.mean(ratios), rel=1e-4)
    overall = np.abs(generated - truth).mean() / np.abs(median - truth).mean()
    assert metrics["gen_raw"] == pytest.approx(overall, rel=1e-4)


def test_the_bound_is_the_sum_of_its_reported_terms(model, halves):
    metrics = evaluate(model, halves[1])
    terms = metrics["log_p_xi"] + metrics["log_p_y"] - metrics["kl"]
    assert metrics["elbo"] == pytest.approx(terms)
    four = ("log_p_xi", "log_p_y", "log_p_latent", "minus_log_q")
    assert metrics["elbo"] == pytest.approx(sum(metrics[name] for name in four))


def test_the_latent_terms_are_the_means_of_their_samples(model, halves):
    held_out = halves[1]
    batch = held_out.gather(np.arange(len(held_out)), torch.device("cpu"))
    torch.manual_seed(0)
    with torch.no_grad():
        q, p = model.eval().posterior(batch.xi, batch.bad, batch.y), model.prior(batch.x)
        draws = [q.rsample() for _ in range(2_000)]
        sampled = {
            "log_p_latent": torch.stack([p.log_prob(draw) for draw in draws]).mean(),
            "minus_log_q": -torch.stack([q.log_prob(draw) for draw in draws]).mean(),
        }
    metrics = evaluate(model, held_out)
    for name, expected in sampled.items():
        assert metrics[name] == pytest.approx(expected.item(), rel=0.02), name


def test_the_error_of_y_and_the_spread_of_latents_are_those_of_plain_loops(model, halves):
    held_out = halves[1]
    batch = held_out.gather(np.arange(len(held_out)), torch.device("cpu"))
    with torch.no_grad():
        tau, y = model.eval().latent_means(batch.x)
        q = model.posterior(batch.xi, batch.bad, batch.y)
    metrics = evaluate(model, held_out)
    assert metrics["mae_y_gen"] == pytest.approx(np.abs(y.numpy() - batch.y.numpy()).mean(), rel=1e-4)
    for d in range(9):
        noise = np.random.default_rng(d).laplace(size=(400, len(held_out)))
        aggregate = np.std(q.loc[:, d].numpy() + q.scale[:, d].numpy() * noise)
        spread = np.std(tau[:, d].numpy()) / aggregate
        assert metrics[f"latent_spread/{d:02d}"] == pytest.approx(spread, rel=0.05)


def test_evaluation_repeats_and_leaves_mode_and_generator_alone(model, halves):
    model.train()
    torch.manual_seed(1)
    expected = torch.rand(1)
    torch.manual_seed(1)
    first = evaluate(model, halves[1])
    assert torch.equal(torch.rand(1), expected)
    assert model.training
    assert evaluate(model, halves[1]) == first


def test_a_dimension_that_never_moves_is_left_out_of_the_errors(model, halves):
    held_out = halves[1]
    xi = held_out.xi.copy()
    xi[:, 2] = model.normaliser.denormalize(model.normaliser.median[None])[0, 2].numpy()
    with torch.no_grad():
        model.normaliser.median[2] = model.normaliser.normalize(torch.from_numpy(xi[:1]))[0, 2]
    assert np.isfinite(evaluate(model, replace(held_out, xi=xi))["gen_norm"])


def test_a_y_that_does_not_vary_is_no_badness_to_learn_and_is_said_with_a_remedy(model, halves):
    held_out = replace(halves[1], y=np.zeros_like(halves[1].y))
    metrics = evaluate(model, held_out)
    assert np.isnan(metrics["corr_y_gen"])
    found = collapse(GOOD | {name: metrics[name] for name in ABOUT_Y}) or ""
    assert "y, which is the same in all held-out episodes: use another G_bad" in found
    assert "model=svae" in found


def test_no_badness_is_asked_of_a_model_without_psi(small_config, halves, bounds):
    model = initialized_model(replace(small_config, psi_dim=0), halves[0], bounds, seed=0)
    metrics = evaluate(model, halves[1])
    assert collapse(GOOD | {name: metrics[name] for name in ABOUT_Y}) is None


@pytest.mark.parametrize("name", ["rec_norm", "gen_norm"])
def test_an_error_that_is_not_a_number_is_a_collapse(name):
    assert f"{name} is not a number; its weights are no longer finite" in (
        collapse(GOOD | {name: float("nan")}) or ""
    )


def test_weights_that_are_not_finite_are_a_collapse(model, halves):
    torch.nn.init.constant_(model.decoder.coefficients.bias, float("nan"))
    assert "rec_norm is not a number" in (collapse(evaluate(model, halves[1])) or "")


@pytest.mark.parametrize(
    ("change", "remedy"),
    [
        ({"active_share": 0.2}, "active_share is 0.20; lower the KL weight"),
        ({"rec_norm": 1.0}, "rec_norm is 1.00; raise the learning rate"),
        ({"gen_norm": 1.1}, "gen_norm is 1.10; collect more episodes"),
        (
            {"corr_y_rec": 0.1},
            "corr_y_rec is 0.10; more episodes or updates, or more weight of y",
        ),
    ],
)
def test_a_collapse_is_named_with_a_remedy(change, remedy):
    assert remedy in (collapse(GOOD | change) or "")


def test_a_model_that_learnt_something_has_not_collapsed():
    assert collapse(GOOD) is None


def test_one_held_out_episode_is_refused(model, halves):
    with pytest.raises(ValueError, match="at least 2 held-out episodes, got 1"):
        evaluate(model, replace(halves[1], rows=halves[1].rows[:1]))
