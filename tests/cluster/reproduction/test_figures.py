"""The figures of the paper as recipes: what they name exists, and the budgets are the paper's."""

import pytest

from cluster.reproduction.cost import comparing, training
from cluster.reproduction.paper_figures import RECIPES, recipe, recipes
from cluster.reproduction.plan import SCALES, scale
from cluster.reproduction.recipe import Panel, Recipe, Training
from cluster.reproduction.transfer import in_other_engine
from svaedc.analysis.evidence import Claim, MedianGap
from svaedc.analysis.paired_evidence import Gain
from svaedc.bo import methods
from svaedc.training.presets import LATENT_SIZES
from workers import setups
from workers.hardware import robots

EVERY = [(each, panel) for each in RECIPES.values() for panel in each.panels]
BUDGETS = {
    "figure-4": ("daisy-11d-rehearsal", 5, 10),
    "figure-5": ("daisy-27d", 50, 20),
    "figure-7": ("yumi-rehearsal", 5, 10),
    "figure-8": ("yumi", 50, 20),
    "figure-9": ("franka", 50, 20),
}
"""Robot, runs and trials after the two random ones, as sections 6.1 and 7.1 of the paper state them."""


@pytest.mark.parametrize(("figure", "budget"), BUDGETS.items())
def test_robots_runs_and_trials_are_those_of_the_paper(figure, budget):
    for panel in RECIPES[figure].panels:
        assert (panel.setup, RECIPES[figure].runs, panel.trials) == budget


def test_the_franka_figure_has_a_panel_of_each_kind():
    left, middle, right = RECIPES["figure-9"].panels
    assert (left.latent, middle.latent, right.latent) == ("3x3", "5x6", "3x3")
    assert RECIPES["figure-9"].trainings == (Training("3x3"), Training("5x6"))
    assert {"matern", "svae-matern", "svae-dc-matern"} <= set(right.methods)


@pytest.mark.parametrize("figure", ["figure-5", "figure-8", "figure-9"])
def test_a_figure_is_asked_again_of_robots_in_another_engine_with_its_own_model_methods_and_runs(figure):
    paper, again = RECIPES[figure], RECIPES[f"{figure}-mujoco"]
    [panel], first = again.panels, paper.panels[0]
    assert (again.data, again.runs) == (paper.data, paper.runs)
    assert (panel.methods, panel.trials, panel.latent) == (first.methods, first.trials, first.latent)
    assert (panel.setup, panel.gap) == (f"{first.setup}-mujoco", "wide")
    assert again.claims
    assert set(again.claims) <= set(paper.claims)


def test_the_study_of_ten_trials_hides_three_robots_in_three_ways_and_trains_twice():
    studies = recipes("transfer")
    assert [each.data for each in studies] == ["franka", "yumi", "daisy-27d"]
    assert all(each.trainings == (Training("3x3"), Training("3x3", 1)) for each in studies)
    for each in studies:
        hidden = {(panel.setup.removeprefix(each.data), panel.gap) for panel in each.panels}
        assert hidden == {("", "paper"), ("", "wide"), ("-mujoco", "wide")}
        simulated = [panel for panel in each.panels if panel.candidates]
        assert len(simulated) == 3
        assert all("simulated-best" in panel.methods for panel in simulated)
        assert all(panel.candidates == (each.data,) for panel in simulated)
    assert recipes("figure-9") == (RECIPES["figure-9"],)


def test_a_panel_that_a_figure_lacks_is_not_asked_of_another_engine():
    with pytest.raises(LookupError, match="figure-9 has no panel 'centre'; there are left, middle, right"):
        in_other_engine(RECIPES["figure-9"], "centre")


def test_gaps_are_measured_from_the_optima_of_the_formulas_in_parts_of_their_ranges():
    claims = RECIPES["figure-13"].claims
    gaps = [e for claim in claims for e in claim.evidence if isinstance(e, MedianGap)]
    names = {panel.name: panel.setup for panel in RECIPES["figure-13"].panels}
    assert len(gaps) == 4
    for gap in gaps:
        low, high = setups.load(names[gap.panel]).objective_limits
        assert gap.optimum == pytest.approx(high)
        whole = {"three-matter": gap.high / 0.05, "all-matter": gap.low / 0.25}[gap.panel]
        assert whole == pytest.approx(high - low, rel=1e-3)


@pytest.mark.parametrize(("each", "panel"), EVERY, ids=lambda part: getattr(part, "name", ""))
def test_a_panel_names_what_exists_and_can_be_billed(each, panel):
    setup = setups.load(panel.setup)
    setup.gap(panel.gap)
    assert comparing(panel.setup, panel.methods, dict.fromkeys(panel.methods, 1.0), 22, 2).seconds > 0
    if panel.latent:
        assert panel.latent in LATENT_SIZES
        assert each.data in (
            panel.setup,
            robots.stands_in_for(panel.setup),
            panel.setup.removesuffix("-mujoco"),
        )
        assert setup.dimensions == setups.load(each.data).dimensions
        for size in SCALES.values():
            assert size.episodes[each.data] >= 10_000
            assert training(each.data, size.preset, panel.latent, 1, 0).seconds > 0
    else:
        assert not any(map(methods.needs_model, panel.methods))


@pytest.mark.parametrize("each", RECIPES.values(), ids=lambda each: each.figure)
def test_every_claim_is_about_methods_and_trials_that_are_compared(each):
    panels = {panel.name: panel for panel in each.panels}
    for evidence in (part for claim in each.claims for part in claim.evidence):
        panel = panels[evidence.panel]
        assert evidence.method in panel.methods
        assert getattr(evidence, "baseline", evidence.method) in panel.methods
        assert getattr(evidence, "after", 1) <= panel.trials


def test_what_replaces_hardware_is_called_a_stand_in_and_nothing_else_is():
    stand_ins = {figure for figure, each in RECIPES.items() if "simulated stand-in" in each.label}
    assert stand_ins == {"figure-4", "figure-7"}
    assert all("simulated stand-in" in panel.label for each, panel in EVERY if each.figure in stand_ins)


def test_unknown_figures_and_scales_are_refused_naming_the_known():
    with pytest.raises(LookupError, match=r"no recipe for 'figure-6'; did you mean 'figure-\d'\? There are"):
        recipe("figure-6")
    with pytest.raises(LookupError, match="no scale called 'small'; there are machine, paper"):
        scale("small")


def test_a_recipe_that_could_never_run_is_refused():
    panel = Panel("one", "", "franka", ("random",), latent="")
    with pytest.raises(ValueError, match=r"panel 'one' needs a latent size for svae, got none"):
        Panel("one", "", "franka", ("svae",), latent="")
    with pytest.raises(ValueError, match="figure-1 needs data for its models, got none"):
        Recipe("figure-1", "", "", 1, (Panel("one", "", "franka", ("svae",)),), ())
    with pytest.raises(ValueError, match=r"panel 'one' needs candidates for simulated-best, got none"):
        Panel("one", "", "franka", ("simulated-best",))
    astray = Claim("better", "section 1", (Gain("two", "se", "random", 1),))
    with pytest.raises(ValueError, match="figure-1 has no panel 'two': better"):
        Recipe("figure-1", "", "", 1, (panel,), (astray,))
