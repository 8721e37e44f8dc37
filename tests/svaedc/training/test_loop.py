"""The loop learns, resumes to the bit, shares work between workers and refuses what it cannot do."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from svaedc.data.samplers import Balanced, WorkerRank
from svaedc.model.diagnostics import collapse, evaluate
from svaedc.model.svae_dc import initialized_model
from svaedc.training.config import StageSettings, TrainingSettings, Weighting
from svaedc.training.distributed import DistributedContext
from svaedc.training.loop import EpochReport, fit

JOINT = StageSettings(
    updates=25,
    optimiser="adam",
    schedule="cosine",
    learning_rate=1e-3,
    weight_decay=0.0,
    dropout=0.0,
    gradient_norm=1.0,
)
SHORT = TrainingSettings(
    joint=JOINT,
    prior=replace(JOINT, updates=22, dropout=0.1, weight_decay=1e-2),
    weighting=Weighting(kl=1.0, y=1.0, warm_up=0.1),
    batch_size=32,
    epoch_updates=10,
    held_out_sample=20,
)


def trained(model, halves, settings=SHORT, **arguments) -> list[EpochReport]:
    return list(fit(model, *halves, settings, **arguments))


def same(first: nn.Module, second: nn.Module) -> bool:
    a, b = first.state_dict(), second.state_dict()
    return all(torch.equal(a[name], b[name]) for name in a)


def test_epochs_are_a_fixed_number_of_updates_and_the_last_one_takes_the_rest(model, halves):
    reports = trained(model, halves)
    assert [(r.stage, r.epoch, r.update) for r in reports] == [
        ("joint", 1, 10),
        ("joint", 2, 20),
        ("joint", 3, 25),
        ("prior", 1, 35),
        ("prior", 2, 45),
        ("prior", 3, 47),
    ]
    assert [r.is_last for r in reports] == [False] * 5 + [True]


@pytest.mark.parametrize("epochs", [1, 2, 3, 4, 5])
def test_a_run_resumed_after_any_epoch_ends_with_the_same_bits(
    small_config, halves, bounds, tmp_path, epochs
):
    whole = initialized_model(small_config, halves[0], bounds, seed=0)
    reports = trained(whole, halves)
    torch.save(reports[epochs - 1].state, tmp_path / "state.pt")
    # Another seed and another position of torch's generator must leave no trace.
    resumed = initialized_model(small_config, halves[0], bounds, seed=9)
    torch.manual_seed(epochs)
    state = torch.load(tmp_path / "state.pt", weights_only=True)
    later = trained(resumed, halves, resume=state)
    assert same(whole, resumed)
    assert [r.metrics for r in later] == [r.metrics for r in reports[epochs:]]


def test_a_finished_run_resumes_to_nothing(model, halves):
    last = trained(model, halves)[-1]
    before = {name: value.clone() for name, value in model.state_dict().items()}
    assert trained(model, halves, resume=last.state) == []
    assert all(torch.equal(value, before[name]) for name, value in model.state_dict().items())


def test_a_state_is_a_copy_that_later_epochs_do_not_change(model, halves):
    reports = fit(model, *halves, SHORT)
    first = next(reports)
    kept = first.state["model"]["badness.output.weight"].clone()
    next(reports)
    assert torch.equal(first.state["model"]["badness.output.weight"], kept)


def test_resuming_with_other_settings_is_refused_with_both_values(model, halves):
    state = next(fit(model, *halves, SHORT)).state
    with pytest.raises(ValueError, match="batch_size was 32, is 16; start a new run"):
        next(fit(model, *halves, replace(SHORT, batch_size=16), resume=state))
    with pytest.raises(ValueError, match=r"joint\.updates was 25, is 30; start a new run"):
        next(fit(model, *halves, SHORT.with_updates(30, 22), resume=state))


def test_training_raises_the_bound_and_uses_every_latent_dimension(model, halves):
    untrained = evaluate(model, halves[1])
    settings = replace(SHORT.with_updates(joint=400, prior=50), epoch_updates=50)
    settings = replace(settings, weighting=Weighting(kl=1.0, y=30.0, warm_up=0.1))
    last = trained(model, halves, settings)[-1]
    metrics = evaluate(model, halves[1])
    assert metrics["elbo"] > untrained["elbo"] + 10.0
    assert metrics["gen_norm"] < 0.9
    assert collapse(metrics) is None
    assert last.metrics["held_out/best_loss"] == pytest.approx(metrics["kl"], rel=0.5)


@pytest.mark.slow
def test_training_for_generation_brings_generated_trajectories_closer(small_config, halves, bounds):
    measured = {}
    for weight in (0.0, 10.0):
        model = initialized_model(small_config, halves[0], bounds, seed=0)
        settings = replace(SHORT.with_updates(joint=120, prior=0), epoch_updates=120)
        settings = replace(settings, weighting=Weighting(1.0, 1.0, 0.1, generation=weight))
        [report] = trained(model, halves, settings)
        assert ("train/log_p_xi_from_x" in report.metrics) == (weight > 0.0)
        measured[weight] = report.metrics
    assert measured[10.0]["held_out/gen_norm"] < measured[0.0]["held_out/gen_norm"]
    assert measured[10.0]["held_out/log_p_xi_from_x"] > measured[0.0]["held_out/log_p_xi_from_x"]


def test_the_second_stage_changes_only_the_prior_and_never_worsens_its_held_out_kl(model, halves):
    reports = trained(model, halves, replace(SHORT, held_out_sample=60))
    joint, final = reports[2].state["model"], model.state_dict()
    changed = {name.split(".")[0] for name in final if not torch.equal(joint[name], final[name])}
    assert changed <= {"prior_network"}
    assert reports[-1].metrics["held_out/kl"] <= reports[2].metrics["held_out/kl"] + 1e-4


def test_the_same_seed_gives_the_same_curve_and_another_seed_another(small_config, halves, bounds):
    curves = []
    for seed in (3, 3, 4):
        model = initialized_model(small_config, halves[0], bounds, seed)
        curves.append([r.metrics for r in trained(model, halves, replace(SHORT, seed=seed))])
    assert curves[0] == curves[1]
    assert curves[0] != curves[2]


IMPATIENT = replace(
    SHORT,
    joint=replace(JOINT, updates=100, learning_rate=1e-9, patience=2.0),
    prior=replace(JOINT, updates=0),
)


@pytest.mark.slow
def test_a_stage_that_no_longer_gets_better_stops_early_and_puts_its_best_epoch_back(model, halves):
    """So small a rate learns nothing; the rounding of each update decides which epoch is best."""
    settings = replace(IMPATIENT, held_out_sample=60, joint=replace(IMPATIENT.joint, updates=400))
    reports = trained(model, halves, settings)
    losses = [
        -(r.metrics["held_out/log_p_xi"] + r.metrics["held_out/log_p_y"] - r.metrics["held_out/kl"]) / 200
        for r in reports
    ]
    assert 3 <= len(reports) < 40
    assert reports[-1].is_last
    assert reports[-1].metrics["held_out/best_loss"] == pytest.approx(min(losses), rel=1e-6)
    assert losses[-1] == pytest.approx(min(losses), rel=1e-6)


def test_a_run_that_stopped_early_resumes_to_its_next_stage(small_config, halves, bounds):
    settings = replace(IMPATIENT, prior=replace(JOINT, updates=20))
    whole = initialized_model(small_config, halves[0], bounds, seed=0)
    reports = trained(whole, halves, settings)
    last_joint = [r for r in reports if r.stage == "joint"][-1]
    assert last_joint.update == 100
    resumed = initialized_model(small_config, halves[0], bounds, seed=9)
    assert {r.stage for r in trained(resumed, halves, settings, resume=last_joint.state)} == {"prior"}
    assert same(whole, resumed)


def test_all_ranks_stop_when_rank_zero_would(model, halves):
    reports = trained(model, halves, IMPATIENT, context=DistributedContext(agree=lambda _: True))
    assert [r.update for r in reports] == [100]


def test_bfloat16_learns_what_float32_learns(small_config, halves, bounds):
    measured = {}
    for precision in ("float32", "bfloat16"):
        model = initialized_model(small_config, halves[0], bounds, seed=0)
        settings = replace(SHORT.with_updates(joint=60, prior=0), epoch_updates=60)
        trained(model, halves, settings, context=DistributedContext(precision=precision))
        assert {value.dtype for value in model.parameters()} == {torch.float32}
        measured[precision] = evaluate(model, halves[1])
    assert measured["bfloat16"] != measured["float32"]
    assert measured["bfloat16"]["rec_norm"] == pytest.approx(measured["float32"]["rec_norm"], abs=0.05)


def test_densities_are_float32_though_networks_compute_in_bfloat16(model, batch):
    with DistributedContext(precision="bfloat16").autocast(torch.device("cpu")):
        terms = model(*batch)
    assert [term.dtype for term in terms] == [torch.float32] * 3


def test_an_unknown_precision_is_refused():
    with pytest.raises(ValueError, match="one of float32, bfloat16, got 'float16'"):
        DistributedContext(precision="float16")


def test_balanced_sampling_trains_on_the_rare_episodes_too(small_config, halves, bounds):
    training, _ = halves
    y = np.asarray(training.y[training.rows])
    models = [initialized_model(small_config, training, bounds, seed=0) for _ in range(2)]
    trained(models[0], halves)
    trained(models[1], halves, order=Balanced(y))
    assert not same(*models)


def test_a_stage_without_updates_is_left_out(model, halves):
    reports = trained(model, halves, replace(SHORT, prior=replace(JOINT, updates=0)))
    assert {r.stage for r in reports} == {"joint"}
    assert reports[-1].is_last


def test_torch_s_generator_is_left_where_it_was(model, halves):
    torch.manual_seed(5)
    expected = torch.rand(1)
    torch.manual_seed(5)
    trained(model, halves)
    assert torch.equal(torch.rand(1), expected)


def test_every_stage_is_wrapped_and_all_that_is_wrapped_gets_gradients(model, halves):
    wrapped = []

    def record(module: nn.Module) -> nn.Module:
        wrapped.append(module)
        return module

    trained(model, halves, context=DistributedContext(parallelize=record))
    assert len(wrapped) == 2
    for module in wrapped:
        assert all(value.grad is not None for value in module.parameters())


def test_workers_of_different_rank_draw_different_noise(small_config, halves, bounds):
    models = [initialized_model(small_config, halves[0], bounds, seed=0) for _ in range(2)]
    for rank, each in enumerate(models):
        next(fit(each, *halves, SHORT, context=DistributedContext(WorkerRank(rank, 2))))
    assert not same(*models)


def test_a_loss_that_is_not_finite_is_an_error_with_a_remedy(model, halves):
    training, held_out = halves
    xi = training.xi.copy()
    xi[training.rows] = np.nan
    with pytest.raises(FloatingPointError, match=r"not finite after update 10.*diverged episodes"):
        next(fit(model, replace(training, xi=xi), held_out, SHORT))


def test_too_few_held_out_episodes_are_refused(model, halves):
    training, held_out = halves
    with pytest.raises(ValueError, match="at least 2 held-out episodes, got 1"):
        next(fit(model, training, replace(held_out, rows=held_out.rows[:1]), SHORT))
