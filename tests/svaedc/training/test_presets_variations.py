"""Changes of a preset, one word each."""

from dataclasses import replace

import pytest
import torch

from svaedc.model.svae_dc import SvaeDc
from svaedc.training.presets import LATENT_SIZES, PRESETS, VARIATIONS, Sizes, preset, vary

SIZES = Sizes(controller_dim=6, observation_dim=5, time_steps=60, plan_channels=4)
UNPLANNED = replace(SIZES, plan_channels=0)
CHANGES = {
    "model": "svae",
    "latent": "5x6",
    "distribution": "gaussian",
    "head": "dense",
    "prior": "mlp",
    "weighting": "balanced",
    "kl_weight": 5.0,
    "learning_rate": 3e-4,
    "patience": 4,
    "epoch_updates": 100,
}
"""A value of each that no preset has."""


def test_every_variation_is_tried_here():
    assert CHANGES.keys() == VARIATIONS.keys()


@pytest.mark.parametrize("name", sorted(PRESETS))
@pytest.mark.parametrize("change", sorted(CHANGES))
def test_a_change_changes_the_preset_and_the_word_preset_nothing(name, change):
    before = preset(name)(SIZES)
    assert vary(before, {change: "preset"}) == before
    after = vary(before, {change: CHANGES[change]})
    is_default = name == "paper" and change == "head"
    assert (after == before) == is_default


@pytest.mark.parametrize("name", sorted(PRESETS))
@pytest.mark.parametrize("latent", sorted(LATENT_SIZES))
@pytest.mark.parametrize("model", ["svae-dc", "svae"])
def test_every_latent_size_of_the_paper_gives_a_finite_bound_with_and_without_psi(name, latent, model):
    torch.manual_seed(0)
    config = vary(preset(name)(UNPLANNED), {"latent": latent, "model": model}).model
    steps, dimensions = map(int, latent.split("x"))
    bound = SvaeDc(config).elbo(torch.rand(1, 6), torch.rand(1, 5, 60), torch.zeros(1, 60), torch.rand(1))
    assert torch.isfinite(bound).all()
    assert config.tau_size == steps * dimensions
    assert config.psi_size == (steps if model == "svae-dc" else 0)


def test_an_unknown_name_or_value_names_the_nearest():
    made = preset("compact")(SIZES)
    with pytest.raises(LookupError, match="no choice called 'latents'; did you mean 'latent'"):
        vary(made, {"latents": "3x3"})
    with pytest.raises(LookupError, match="no latent size called '5x5'; did you mean '5x6'"):
        vary(made, {"latent": "5x5"})
    with pytest.raises(ValueError, match="distribution must be one of laplace, gaussian, got 'cauchy'"):
        vary(made, {"distribution": "cauchy"})


def test_a_number_out_of_its_range_is_refused():
    with pytest.raises(ValueError, match=r"kl=-1\.0"):
        vary(preset("compact")(SIZES), {"kl_weight": -1.0})


def test_changes_count_the_same_in_whatever_order_they_are_written():
    made = preset("compact")(SIZES)
    forwards = vary(made, CHANGES)
    assert vary(made, dict(reversed(CHANGES.items()))) == forwards
    assert vary(made, {"kl_weight": 3.0, "weighting": "balanced"}).training.weighting.kl == 3.0
    assert forwards.training.weighting.y == 100.0


def test_the_compact_preset_reads_plans_where_there_are_some():
    reader, other = (preset("compact")(sizes) for sizes in (SIZES, UNPLANNED))
    assert (reader.model.prior, other.model.prior) == ("plan", "mlp")
    assert reader.training.joint.dropout > 0
    assert vary(reader, {"prior": "mlp"}).training == other.training
