"""Training settings refuse what cannot be meant, and schedules are the paper's."""

from dataclasses import replace

import pytest

from svaedc.training.config import WEIGHTINGS, StageSettings, TrainingSettings, Weighting

STAGE = StageSettings(
    updates=40_000,
    optimiser="rmsprop",
    schedule="halving",
    learning_rate=1e-4,
    weight_decay=0.0,
    dropout=0.0,
    gradient_norm=1.0,
)
SETTINGS = TrainingSettings(STAGE, STAGE, WEIGHTINGS["paper"], batch_size=32)


def test_the_paper_s_learning_rate_halves_every_5000_updates_and_stops_at_1e_5():
    rates = [STAGE.learning_rate_at(update) for update in (0, 4_999, 5_000, 10_000, 15_000, 20_000, 39_999)]
    assert rates == [1e-4, 1e-4, 5e-5, 2.5e-5, 1.25e-5, 1e-5, 1e-5]


def test_cosine_decay_starts_at_the_learning_rate_and_ends_near_zero():
    stage = replace(STAGE, schedule="cosine")
    assert stage.learning_rate_at(0) == 1e-4
    assert stage.learning_rate_at(20_000) == pytest.approx(5e-5)
    assert stage.learning_rate_at(39_999) < 1e-12


def test_the_kl_weight_rises_linearly_and_then_stays():
    weighting = Weighting(kl=2.0, y=1.0, warm_up=0.1)
    assert [weighting.kl_at(progress) for progress in (0.0, 0.05, 0.1, 0.9)] == [0.0, 1.0, 2.0, 2.0]


def test_without_warm_up_the_kl_weight_is_full_from_the_first_update():
    assert Weighting(kl=1.0, y=1.0, warm_up=0.0).kl_at(0.0) == 1.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"updates": -1}, "updates"),
        ({"learning_rate": 0.0}, "learning_rate"),
        ({"optimiser": "sgd"}, "optimiser must be one of adam, rmsprop, got 'sgd'"),
        ({"schedule": "step"}, "schedule must be one of cosine, halving"),
        ({"dropout": 1.0}, r"dropout must be in \[0, 1\)"),
        ({"gradient_norm": 0.0}, "gradient_norm above 0"),
    ],
)
def test_impossible_stages_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        replace(STAGE, **change)


def test_other_budgets_leave_everything_else_alone():
    changed = SETTINGS.with_updates(joint=7, prior=0)
    assert (changed.joint.updates, changed.prior.updates) == (7, 0)
    assert changed.with_updates(joint=40_000, prior=40_000) == SETTINGS


@pytest.mark.parametrize("name", ["batch_size", "epoch_updates", "held_out_sample"])
def test_counts_below_their_minimum_are_refused(name):
    with pytest.raises(ValueError, match=f"{name} must be at least"):
        replace(SETTINGS, **{name: 0})


@pytest.mark.parametrize("weights", [(-1.0, 1.0, 0.1), (1.0, float("nan"), 0.1), (1.0, 1.0, 1.5)])
def test_impossible_weights_are_refused(weights):
    with pytest.raises(ValueError, match=r"must be finite|share of the updates"):
        Weighting(*weights)
