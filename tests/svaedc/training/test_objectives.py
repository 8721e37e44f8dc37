"""The losses of the two stages, against the formulas, and which epoch each keeps."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from svaedc.model.distributions import kl_divergence
from svaedc.training.config import StageSettings, TrainingSettings, Weighting
from svaedc.training.objectives import JointStage, PriorStage, posteriors

STAGE = StageSettings(10, "adam", "cosine", 1e-3, 0.0, 0.0, 1.0)
HYBRID = Weighting(kl=2.0, y=3.0, warm_up=0.5, generation=0.25)
POSITIONS = np.array([5, 3, 8])


def settings(weighting: Weighting, patience: float = float("inf")) -> TrainingSettings:
    stage = replace(STAGE, patience=patience)
    return TrainingSettings(joint=stage, prior=stage, weighting=weighting, batch_size=3)


def test_the_joint_loss_is_the_weighted_bound_per_element_with_a_kl_that_rises(model, halves):
    stage = JointStage(model, halves[0], settings(HYBRID))
    for progress, kl_weight in ((0.0, 0.0), (0.25, 1.0), (0.5, 2.0), (1.0, 2.0)):
        stage.progress = progress
        loss, terms = stage.loss(stage.module, POSITIONS)
        bound = terms["log_p_xi"] + 3.0 * terms["log_p_y"] - kl_weight * terms["kl"]
        generated = 0.25 * (terms["log_p_xi_from_x"] + 3.0 * terms["log_p_y_from_x"])
        assert loss.item() == pytest.approx(-(bound + generated).item() / (5 * 40), rel=1e-5)


def test_the_reported_bound_is_unweighted_and_nothing_is_generated_without_a_weight(model, halves):
    stage = JointStage(model, halves[0], settings(replace(HYBRID, generation=0.0)))
    _, terms = stage.loss(stage.module, POSITIONS)
    assert terms.keys() == {"elbo", "log_p_xi", "log_p_y", "kl"}
    expected = terms["log_p_xi"] + terms["log_p_y"] - terms["kl"]
    assert terms["elbo"].item() == pytest.approx(expected.item())


def test_the_prior_is_refitted_to_the_posteriors_of_the_episodes_that_were_asked_for(model, halves):
    stage = PriorStage(model, halves[0], settings(Weighting(kl=7.0, y=1.0, warm_up=0.0)))
    model.eval()
    loss, _ = stage.loss(stage.module, POSITIONS)
    batch = halves[0].gather(POSITIONS, torch.device("cpu"))
    with torch.no_grad():
        q = model.posterior(batch.xi, batch.bad, batch.y)
        expected = kl_divergence(q, model.prior(batch.x)).mean()
    assert loss.item() == pytest.approx(expected.item(), rel=1e-5)


def test_the_second_stage_trains_the_prior_alone_and_sets_the_others_free_at_its_end(model, halves):
    stage = PriorStage(model, halves[0], settings(HYBRID))
    stage.loss(stage.module, POSITIONS)[0].backward()
    assert all(parameter.grad is not None for parameter in model.prior_network.parameters())
    others = [*model.decoder.parameters(), *model.badness.parameters(), *model.posterior_network.parameters()]
    assert all(parameter.grad is None for parameter in others)
    stage.end_epoch({"kl": 1.0, "log_p_xi_from_x": 0.0, "log_p_y_from_x": 0.0})
    stage.finish()
    assert all(parameter.requires_grad for parameter in model.parameters())


def test_a_stage_that_does_not_get_better_is_stale_after_its_patience_and_puts_its_best_back(model, halves):
    stage = PriorStage(model, halves[0], settings(Weighting(kl=1.0, y=1.0, warm_up=0.0), patience=2.0))
    assert stage.end_epoch({"kl": 3.0}) == 3.0
    best = [parameter.detach().clone() for parameter in model.prior_network.parameters()]
    for kl, is_stale in ((4.0, False), (3.0, True)):
        with torch.no_grad():
            for parameter in model.prior_network.parameters():
                parameter.add_(1.0)
        assert stage.end_epoch({"kl": kl}) == 3.0
        assert stage.is_stale == is_stale
    stage.finish()
    assert all(map(torch.equal, model.prior_network.parameters(), best))


def test_only_early_stopping_makes_the_joint_stage_keep_an_earlier_epoch(model, halves):
    assert not JointStage(model, halves[0], settings(HYBRID)).keeps_best
    assert JointStage(model, halves[0], settings(HYBRID, patience=3.0)).keeps_best


def test_posteriors_are_those_of_each_episode_in_storage_order(model, halves):
    found = posteriors(model, halves[1])
    batch = halves[1].gather(np.array([0, len(halves[1]) - 1]), torch.device("cpu"))
    with torch.no_grad():
        q = model.posterior(batch.xi, batch.bad, batch.y)
    torch.testing.assert_close(found.loc[[0, -1]], q.loc)
    torch.testing.assert_close(found.scale[[0, -1]], q.scale)
    assert not found.loc.requires_grad
