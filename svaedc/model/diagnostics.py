"""What a trained model has learnt, measured on held-out episodes, and whether it has collapsed."""

from functools import partial
from math import isnan
from typing import Final

import torch
from jaxtyping import Float
from torch import Tensor

from svaedc.data.episodes import Batch, Episodes, measure_batches
from svaedc.model.svae_dc import SvaeDc

_MEANS: Final = ("log_p_xi", "log_p_y", "minus_log_q", "kl", "log_p_xi_from_x", "log_p_y_from_x")
ACTIVE_SHARE_OF_SPREAD: Final = 0.1
"""Dimension d is active if E[tau_d|x] spreads over controllers by at least this share of the aggregate
posterior."""

REMEDIES: Final = {  # in brackets the setting, as the section `train` names it
    "active_share": "lower the KL weight (kl_weight) or train longer (updates)",
    "corr_y_rec": "more episodes or updates, or more weight of y (weighting=balanced)",
    "rec_norm": "raise the learning rate (learning_rate) or train longer (updates)",
    "gen_norm": "collect more episodes, or train longer (updates)",
}
_UNDEFINED: Final = (
    "its weights are no longer finite, or nothing moves in the held-out episodes: lower the learning rate "
    "(learning_rate), or look at the episodes (svaedc render)"
)


def evaluate(model: SvaeDc, episodes: Episodes) -> dict[str, float]:
    """Named measures of a model on held-out episodes, in evaluation mode.

    `rec` decodes the mean of q(tau|xi, y), `gen` the mean of p(tau|x). Errors are relative to predicting the
    per-step median of the training data: `norm` is the mean over dimensions of that ratio, `raw` the ratio of
    the means over all elements in parts of the observation range; 1 is no better than the median. Dimensions
    that never leave their median are left out. A correlation is NaN when the true y does not vary and 0 when
    the predicted y does not; whatever is about y is NaN for an SVAE.

    Args:
        model: Put back into the mode it was in.
        episodes: Held-out ones, at least two.

    Returns:
        `rec_norm`, `rec_raw`, `gen_norm`, `gen_raw`; `corr_y_rec`, `corr_y_gen` and the mean absolute errors
        `mae_y_rec`, `mae_y_gen`; `active_dimensions`, `active_share` and the `latent_spread/NN` of each
        dimension that they count, the standard deviation of E[tau_d|x] over controllers in parts of that of
        the aggregate posterior; and, per episode and unweighted, the four terms `log_p_xi`, `log_p_y`,
        `log_p_latent` and `minus_log_q`, their sum `elbo`, and `kl`, minus the sum of the last two; and
        `log_p_xi_from_x` and `log_p_y_from_x`, the first two terms at the means of p(tau, psi|x).

    Raises:
        ValueError: Fewer than two episodes: nothing varies.
    """
    if len(episodes) < 2:
        raise ValueError(f"diagnostics need at least 2 held-out episodes, got {len(episodes)}; collect more")
    device = model.normaliser.low.device
    was_training = model.training
    model.eval()
    # A fixed seed makes the draw of q the same in every evaluation and leaves the caller's generator alone.
    with torch.random.fork_rng(devices=[device] if device.type == "cuda" else []):
        torch.manual_seed(0)
        found = measure_batches(episodes, device, partial(_measure, model))
    model.train(was_training)
    return _summary({name: values.cpu().double() for name, values in found.items()})


def collapse(metrics: dict[str, float]) -> str | None:
    """Why a model must not be used, with a remedy, or None when it has learnt something of everything.

    Args:
        metrics: Those of `evaluate`. Of an SVAE, whatever is about y is NaN, and y is not asked of it.
    """
    too_little = {"active_share": 1 / 3, "corr_y_rec": 0.5}
    too_much = {"rec_norm": 0.95, "gen_norm": 0.98}
    for name in too_much:
        if isnan(metrics[name]):
            return f"the model collapsed: {name} is not a number; {_UNDEFINED}"
    collapsed = [name for name, least in too_little.items() if metrics[name] < least]
    collapsed += [name for name, most in too_much.items() if metrics[name] > most]
    if collapsed:
        name = collapsed[0]
        return f"the model collapsed: {name} is {metrics[name]:.2f}; {REMEDIES[name]}"
    if isnan(metrics["corr_y_rec"]) and not isnan(metrics["mae_y_rec"]):  # an SVAE predicts no y at all
        return (
            "the model cannot have learnt y, which is the same in all held-out episodes: use another G_bad "
            "(svaedc collect --bad), or train without badness (model=svae)"
        )
    return None


def _measure(model: SvaeDc, batch: Batch) -> dict[str, Float[Tensor, "batch *rest"]]:
    """Per-episode quantities that the summary averages."""
    terms = model(*batch)
    q, p = model.posterior(batch.xi, batch.bad, batch.y), model.prior(batch.x)
    (q_tau, q_psi), (p_tau, p_psi) = model.split(q.loc), model.split(p.loc)
    xi = model.normaliser.normalize(batch.xi)
    log_p_xi_from_x, log_p_y_from_x = model.generation_terms(p, batch.xi, batch.y)
    return {
        "median_error": (model.normaliser.median - xi).abs().mean(-1),
        "rec_error": (model.p_xi(q_tau).loc - xi).abs().mean(-1),
        "gen_error": (model.p_xi(p_tau).loc - xi).abs().mean(-1),
        "log_p_xi_from_x": log_p_xi_from_x,
        "log_p_y_from_x": log_p_y_from_x,
        "y": batch.y,
        "y_rec": _predict(model, q_psi),
        "y_gen": _predict(model, p_psi),
        "minus_log_q": q.entropy(),
        "q_tau": q_tau,
        "q_tau_variance": model.split(q.variance)[0],
        "p_tau": p_tau,
        **terms._asdict(),
    }


def _predict(model: SvaeDc, psi: Float[Tensor, "batch psi"]) -> Float[Tensor, " batch"]:
    return model.p_y(psi).loc if model.config.has_psi else psi.new_full((len(psi),), torch.nan)


def _summary(measured: dict[str, Tensor]) -> dict[str, float]:
    error = {name: measured[f"{name}_error"].mean(0) for name in ("median", "rec", "gen")}
    moving = error["median"] > 0.0
    aggregate_std = (measured["q_tau"].var(0) + measured["q_tau_variance"].mean(0)).sqrt()
    spread = measured["p_tau"].std(0) / aggregate_std
    active = spread >= ACTIVE_SHARE_OF_SPREAD
    summary = {
        "active_dimensions": active.double().sum(),
        "active_share": active.double().mean(),
        **{f"latent_spread/{d:02d}": each for d, each in enumerate(spread)},
        **{name: values.mean() for name, values in measured.items() if name in _MEANS},
    }
    for name in ("rec", "gen"):
        summary[f"mae_y_{name}"] = (measured["y"] - measured[f"y_{name}"]).abs().mean()
        summary[f"{name}_norm"] = (error[name] / error["median"])[moving].mean()
        summary[f"{name}_raw"] = error[name].mean() / error["median"].mean()
        summary[f"corr_y_{name}"] = _correlation(measured["y"], measured[f"y_{name}"])
    # KL(q || p) = E[log q] - E[log p], so the closed form of the cross entropy needs no other sample.
    summary["log_p_latent"] = -summary["kl"] - summary["minus_log_q"]
    summary["elbo"] = summary["log_p_xi"] + summary["log_p_y"] - summary["kl"]
    return {name: float(value) for name, value in summary.items()}


def _correlation(truth: Float[Tensor, " n"], prediction: Float[Tensor, " n"]) -> Tensor:
    if truth.std() == 0.0:
        return torch.tensor(torch.nan)
    # Below this spread a prediction is constant up to rounding.
    if prediction.std() < 1e-6:
        return torch.tensor(0.0)
    return torch.corrcoef(torch.stack([truth, prediction]))[0, 1]
