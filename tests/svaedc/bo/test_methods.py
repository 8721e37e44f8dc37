from dataclasses import replace

import numpy as np
import pytest
import torch

from svaedc.bo import methods
from svaedc.bo.candidates import Problem, as_they_are, by_latents
from svaedc.bo.features import Latents, svae_dc
from svaedc.bo.history import History
from tests.svaedc.bo.fake_latents import latent_means, problem, quadratic


def best_of_run(name, seed, count=12):
    method = methods.build(name, problem(2, 400, seed))
    rng = np.random.default_rng(1000 + seed)
    history = History.empty(2)
    for x in rng.random((2, 2), dtype=np.float32):
        history = history.append(x, quadratic(x))
    for _ in range(count):
        x = method.suggest(history, rng)
        history = history.append(x, quadratic(x))
    return history.f.max()


@pytest.mark.parametrize(
    "name", ["se", *(pytest.param(name, marks=pytest.mark.slow) for name in ("matern", "svae"))]
)
@pytest.mark.slow
def test_optimisation_comes_closer_to_the_optimum_than_random_search(name):
    regret = {
        method: np.mean([1 - best_of_run(method, seed) for seed in range(4)]) for method in ("random", name)
    }
    assert regret[name] < 0.3 * regret["random"]


@pytest.mark.parametrize("name", ["screened-random", "screened-svae"])
def test_screening_suggests_only_from_the_least_bad_share(name):
    given = problem(3, 100, 0)
    kept = given.pool[np.argsort(given.latents.y.numpy())[:30]]
    method = methods.build(name, given)
    history = History.empty(3)
    for index in range(12):
        x = method.suggest(history, np.random.default_rng(index))
        assert (kept == x).all(axis=1).any()
        history = history.append(x, quadratic(x))


def test_screened_random_search_exhausts_its_share_and_says_so():
    method = methods.build("screened-random", problem(3, 10, 0))
    history = History.empty(3)
    for index in range(3):
        history = history.append(method.suggest(history, np.random.default_rng(index)), 0.0)
    with pytest.raises(ValueError, match=r"all 3 candidates have been tried.*larger pool"):
        method.suggest(history, np.random.default_rng(9))


@pytest.mark.parametrize("name", ["screened-random", "screened-svae", "se", "svae-dc", "turbo-pool"])
def test_a_pool_that_would_run_dry_is_refused_before_the_first_trial(name):
    given, kept = problem(3, 10, 0), 3 if "screened" in name else 10
    methods.require(name, given, kept)
    with pytest.raises(
        ValueError, match=rf"'{name}' may choose from {kept} of 10 .* its {kept + 1} trials.*larger pool"
    ):
        methods.require(name, given, kept + 1)


@pytest.mark.parametrize("name", ["random", "botorch", "svae-dc-acqf"])
def test_a_method_that_searches_the_cube_suggests_more_controllers_than_its_pool_has(name):
    given, history = problem(3, 1, 0), History.empty(3)
    methods.require(name, given, 4)
    method = methods.build(name, given)
    for index in range(4):
        x = method.suggest(history, np.random.default_rng(index))
        history = history.append(x, quadratic(x))
    assert len(np.unique(history.x, axis=0)) == 4


@pytest.mark.slow
def test_compression_spends_fewer_trials_on_controllers_predicted_bad():
    def mean_badness(name):
        badness = []
        for seed in range(4):
            given = problem(4, 300, seed)
            method, history, rng = methods.build(name, given), History.empty(4), np.random.default_rng(seed)
            for _ in range(12):
                x = method.suggest(history, rng)
                y = given.latents.means(torch.tensor(x)[None])[1].item()
                badness.append(y)
                history = history.append(x, float(-y))
        return np.mean(badness)

    assert mean_badness("svae-dc") < mean_badness("random") - 0.1


@pytest.mark.parametrize(("name", "sum_of_three"), [("botorch", 5.0), ("se-acqf", 3.0)])
def test_search_off_the_pool_needs_neither_model_nor_pool(name, sum_of_three):
    bare = Problem(30, (0.0, 13.0), np.empty((0, 30), dtype=np.float32))
    history = History.empty(30)
    rng = np.random.default_rng(0)
    for x in rng.random((4, 30), dtype=np.float32):
        history = history.append(x, float(((x[:3] + 1) ** 2).sum()))
    x = methods.build(name, bare).suggest(history, rng)
    assert x.shape == (30,)
    assert (x[:3] + 1).sum() >= sum_of_three


def test_features_are_in_units_of_their_typical_distance():
    given = problem(4, 200, 0)
    for candidates, tolerance in ((as_they_are(given), 0.05), (by_latents(given, svae_dc), 0.01)):
        assert torch.pdist(candidates.phi).square().mean().sqrt().item() == pytest.approx(1, rel=tolerance)


def test_measured_controller_of_the_pool_has_the_features_of_its_candidate():
    given = problem(4, 20, 0)
    candidates = by_latents(given, svae_dc)
    torch.testing.assert_close(candidates.features_of(torch.tensor(given.pool).double()), candidates.phi)


def test_pool_of_identical_controllers_is_no_division_by_zero():
    flat = Problem(2, (0.0, 1.0), np.full((3, 2), 0.5, dtype=np.float32))
    flat = replace(flat, latents=Latents.of(torch.tensor(flat.pool), latent_means))
    assert torch.isfinite(by_latents(flat, svae_dc).phi).all()


def test_model_is_needed_exactly_where_latents_are_used():
    assert [name for name in methods.names() if methods.needs_model(name)] == [
        *("bbk-kl", "ensemble-svae", "ensemble-svae-dc", "lkl", "prior-svae", "prior-svae-dc"),
        *("residual-svae", "residual-svae-dc"),
        *("screened-random", "screened-svae", "svae", "svae-dc", "svae-dc-matern"),
        *("svae-dc-online", "svae-dc-sigmoid", "svae-dc-whitened", "svae-matern"),
    ]
    assert methods.needs_model("svae-dc-acqf-ei")
    assert not methods.needs_model("botorch-pool-ucb")


def test_unknown_method_is_refused_with_the_nearest_name():
    for use in (methods.needs_model, lambda name: methods.build(name, problem(2, 5, 0))):
        with pytest.raises(LookupError, match=r"'svae-cd'.*did you mean 'svae-dc'"):
            use("svae-cd")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("se-pool", r"repeat what 'se' does anyway \(pool, ucb\), got 'se-pool'"),
        ("se-acqf-ucb", r"repeat what 'se' does anyway"),
        ("botorch-ei", r"repeat what 'botorch' does anyway \(acqf, ei\)"),
        ("random-acqf", r"one of .*got 'random-acqf': did you mean 'random'"),
        ("se-ei-acqf", r"one of .*got 'se-ei-acqf'"),
        ("-ei", r"one of .*got '-ei'"),
    ],
)
def test_every_method_has_one_name(name, message):
    with pytest.raises(LookupError, match=message):
        methods.needs_model(name)


def test_a_kernel_has_a_lengthscale_for_every_dimension_of_its_features():
    given = problem(4, 30, 0)
    history = History.empty(4)
    for x in given.pool[:3]:
        history = history.append(x, quadratic(x))
    expected = {"se": 4, "matern": 4, "svae": 3, "svae-dc-matern": 3, "svae-dc-whitened": 3}
    for name, count in expected.items():
        surrogate, _ = methods.build(name, given).surrogate.after(history)
        assert surrogate.model.covar_module.base_kernel.lengthscale.numel() == count


def test_trust_region_keeps_to_its_box_and_begins_anew_with_random_controllers():
    method, history = methods.build("turbo-pool", problem(4, 200, 0)), History.empty(4)
    for x in np.random.default_rng(0).random((2, 4), dtype=np.float32):
        history = history.append(x, 0.0)
    center = history.x[0]
    # Flat outcomes halve the box from 0.8 until it is left: 7 halvings of 4 failures each.
    for index in range(28):
        x = method.suggest(history, np.random.default_rng(index))
        history = history.append(x, 0.0)
    assert np.abs(history.x[-1] - center).max() < 0.05 < np.abs(history.x[2] - center).max()
    fresh = [method.suggest(history, np.random.default_rng(index)) for index in range(20)]
    assert np.abs(np.array(fresh) - center).max() > 0.4


def test_method_without_its_model_or_pool_says_what_to_do():
    given = problem(2, 5, 0)
    pool = given.pool
    for name in filter(methods.needs_model, methods.names()):
        with pytest.raises(
            ValueError, match=rf"'{name}': (latents|densities|adjustable layers) must be.*train one"
        ):
            methods.build(name, Problem(2, (0.0, 1.0), pool, simulated=given.simulated))
    with pytest.raises(ValueError, match=r"'se'.*got 0 controllers"):
        methods.build("se", Problem(2, (0.0, 1.0), pool[:0]))


def test_parts_of_a_problem_that_do_not_belong_together_are_refused():
    given = problem(2, 5, 0)
    with pytest.raises(ValueError, match=r"low < high, got \(1.0, 1.0\)"):
        Problem(2, (1.0, 1.0), given.pool)
    with pytest.raises(ValueError, match=r"pool must be \[n, 3\], got \[5, 2\]"):
        Problem(3, (0.0, 1.0), given.pool)
    with pytest.raises(ValueError, match="unit cube"):
        Problem(2, (0.0, 1.0), given.pool + 1)
    with pytest.raises(ValueError, match="pool's 4 controllers, got 5"):
        Problem(2, (0.0, 1.0), given.pool[:4], given.latents)


@pytest.mark.parametrize(
    "name",
    ["svae-dc", "svae-dc-sigmoid", "svae-dc-online", "svae-dc-whitened", "screened-random", "screened-svae"],
)
def test_a_method_that_compresses_or_screens_refuses_a_model_that_knows_no_badness(name):
    given = problem(2, 20, 0)
    blind = replace(given, latents=replace(given.latents, y=torch.zeros_like(given.latents.y)))
    with pytest.raises(ValueError, match=rf"method '{name}': the model must predict badness, got an SVAE"):
        methods.build(name, blind)
    assert methods.build("svae", blind)
