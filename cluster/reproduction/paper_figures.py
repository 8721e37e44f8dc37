"""The figures of the paper as recipes: which data, which model, which comparisons, and what was claimed.

A further figure is one entry here; those asked again in MuJoCo are made from the paper's, and `transfer` is a
study of our own. Sections are those of the paper.
"""

import difflib
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from cluster.reproduction.recipe import THIRTY, Panel, Recipe
from cluster.reproduction.ten_trials import TRANSFER, transfer_studies
from cluster.reproduction.transfer import in_other_engine
from svaedc.analysis.evidence import Claim, MedianGap, Steadier, Successes
from svaedc.analysis.paired_evidence import Gain, Like, NoBetter

_PAPERS = ("random", "se", "bbk-kl", "svae", "svae-dc")
_CONTROLS = ("screened-random", "screened-svae", "botorch")
_COMPARED = (*_PAPERS, "svae-dc-whitened", *_CONTROLS)
_ON_HARDWARE = ("random", "se", "svae-dc", "svae-dc-whitened", *_CONTROLS)


def _gains(panel: str, method: str, baselines: tuple[str, ...], after: tuple[int, ...]) -> tuple[Gain, ...]:
    """The method is better than each baseline, at each number of suggested trials."""
    return tuple(Gain(panel, method, baseline, trials) for trials in after for baseline in baselines)


def _control(panel: str, after: tuple[int, ...]) -> Claim:
    """What the paper does not ask: does compression add to plain screening, and to today's usual choice?"""
    text = "better than screening by predicted badness, and than BoTorch's default"
    return Claim(text, "control", _gains(panel, "svae-dc", _CONTROLS, after))


def _few_suffice(method: str) -> tuple[MedianGap]:
    """Appendix C, where three dimensions matter: within 5 % of the range of the optimum."""
    return (MedianGap("three-matter", method, 12.027, 20, high=0.451),)


def _modest(method: str) -> tuple[Gain, MedianGap]:
    """Appendix C, where all matter: at most a quarter of the range gained, at least one lacking."""
    gain = Gain("all-matter", method, "random", 60, high=22.5)
    return gain, MedianGap("all-matter", method, 120.0, 60, low=22.5)


_RECIPES = (
    Recipe(
        "figure-4",
        "BO on the Daisy hexapod, hardware",
        data="daisy-11d",
        runs=5,
        panels=(Panel("walk", "11-D walking", "daisy-11d-rehearsal", _ON_HARDWARE, trials=10, gap="wide"),),
        claims=(
            Claim(
                "SVAE-DC found walking controllers in 5 of 5 runs within 10 trials",
                "section 6.1, figure 4",
                (Successes("walk", "svae-dc", "runs", 1.0, 1.0),),
            ),
            Claim(
                "SE found them in 2 of 5 runs",
                "section 6.1, figure 4",
                (Successes("walk", "se", "runs", 0.0, 0.4),),
            ),
            Claim(
                "of 60 random controllers 2 walked 1.5 m, fewer than 4 %",
                "section 6.1",
                (Successes("walk", "random", "trials", 0.0, 0.04),),
            ),
            Claim("SVAE-DC above SE", "section 6.1, figure 4", _gains("walk", "svae-dc", ("se",), (10,))),
            _control("walk", (10,)),
        ),
    ),
    Recipe(
        "figure-5",
        "BO for Daisy in simulation",
        data="daisy-27d",
        runs=50,
        panels=(Panel("walk", "27-D walking", "daisy-27d", _COMPARED),),
        claims=(
            Claim(
                "SVAE-DC outperformed all baselines",
                "section 6.1, figure 5",
                _gains("walk", "svae-dc", ("random", "se", "bbk-kl", "svae"), (10, 20)),
            ),
            Claim(
                "BBK-KL obtained smaller improvements over SE and random",
                "section 6.1, figure 5",
                _gains("walk", "bbk-kl", ("random", "se"), (20,)),
            ),
            Claim("SVAE was very similar to SE", "section 6.1", (Like("walk", "svae", "se", 20),)),
            _control("walk", (10, 20)),
        ),
    ),
    Recipe(
        "figure-7",
        "BO on ABB YuMi, hardware",
        data="yumi",
        runs=5,
        panels=(Panel("push", "stable push, slow", "yumi-rehearsal", _ON_HARDWARE, trials=10, gap="wide"),),
        claims=(
            Claim(
                "SVAE-DC significantly outperformed SE",
                "section 7.1, figure 7",
                _gains("push", "svae-dc", ("se",), (10,)),
            ),
            _control("push", (10,)),
        ),
    ),
    Recipe(
        "figure-8",
        "BO on ABB YuMi, simulation",
        data="yumi",
        runs=50,
        panels=(Panel("push", "stable push", "yumi", _COMPARED),),
        claims=(
            Claim(
                "SVAE-DC yielded substantial improvement over all baselines",
                "section 7.1, figure 8",
                _gains("push", "svae-dc", ("random", "se", "bbk-kl"), (10, 20)),
            ),
            Claim(
                "SVAE also outperformed all baselines substantially",
                "section 7.1, figure 8",
                _gains("push", "svae", ("random", "se", "bbk-kl"), (20,)),
            ),
            Claim(
                "SVAE matched SVAE-DC after about 15 trials",
                "section 7.1, figure 8",
                (Gain("push", "svae-dc", "svae", 5), Like("push", "svae-dc", "svae", 15)),
            ),
            _control("push", (10, 20)),
        ),
    ),
    Recipe(
        "figure-9",
        "BO on Franka Emika, simulation",
        data="franka",
        runs=50,
        panels=(
            Panel("left", "9-D latent paths", "franka", _COMPARED),
            Panel("middle", "30-D latent paths, larger networks", "franka", _PAPERS, latent=THIRTY),
            Panel(
                "right",
                "Matérn-5/2 as outer kernel",
                "franka",
                ("random", "se", "matern", "svae-matern", "svae-dc-matern"),
            ),
        ),
        claims=(
            Claim(
                "left: SVAE-DC above all baselines",
                "figure 9, the curves of its left plot",
                _gains("left", "svae-dc", ("random", "se", "bbk-kl"), (10, 20)),
            ),
            Claim(
                "SE did not consistently outperform random search",
                "section 7.1",
                (NoBetter("left", "se", "random", 20),),
            ),
            _control("left", (10, 20)),
            Claim(
                "middle: SVAE outperforms BBK-KL and SE, not as early as before",
                "section 7.1, figure 9",
                _gains("middle", "svae", ("bbk-kl", "se"), (20,)),
            ),
            Claim(
                "middle: SVAE-DC keeps its gains, with less variance between runs",
                "section 7.1, figure 9",
                (
                    *_gains("middle", "svae-dc", ("random", "se", "bbk-kl"), (10, 20)),
                    Steadier("middle", "left", "svae-dc"),
                ),
            ),
            Claim(
                "right: Matérn no better than SE, and not consistently above random",
                "section 7.1, figure 9",
                (NoBetter("right", "matern", "se", 20), NoBetter("right", "matern", "random", 20)),
            ),
            Claim(
                "right: SVAE-Matérn modestly above the baselines",
                "section 7.1, figure 9",
                _gains("right", "svae-matern", ("random", "matern"), (20,)),
            ),
            Claim(
                "right: SVAE-DC-Matérn keeps most improvements",
                "section 7.1, figure 9",
                _gains("right", "svae-dc-matern", ("random", "matern"), (10, 20)),
            ),
        ),
    ),
    Recipe(
        "figure-13",
        "BO in 30-D, appendix C",
        data="",
        runs=20,
        panels=(
            Panel(
                "three-matter",
                "three of 30 dimensions matter",
                "quadratic-30d-intrinsic-3",
                ("random", "se", "se-acqf", "botorch"),
                latent="",
            ),
            Panel(
                "all-matter",
                "all 30 dimensions matter",
                "quadratic-30d",
                ("random", "se", "se-acqf", "botorch"),
                trials=60,
                latent="",
            ),
        ),
        claims=(
            Claim(
                "SE succeeds with few trials where three dimensions matter (within 5 % of the range: ours)",
                "appendix C, figure 13",
                _few_suffice("se-acqf"),
            ),
            Claim(
                "SE gives only modest gains in 60 trials where all matter (a quarter of the range: ours)",
                "appendix C",
                _modest("se-acqf"),
            ),
            Claim(
                "both, where SE chooses from random points, of which none is near a corner of 30 dimensions",
                "control",
                (*_few_suffice("se"), *_modest("se")),
            ),
        ),
    ),
)
_FIGURES = {recipe.figure: recipe for recipe in _RECIPES}
_TRANSFERS = (("figure-5", "walk"), ("figure-8", "push"), ("figure-9", "left"))
RECIPES: Final[Mapping[str, Recipe]] = MappingProxyType(
    _FIGURES
    | {each.figure: each for each in (in_other_engine(_FIGURES[name], panel) for name, panel in _TRANSFERS)}
    | {each.figure: each for each in transfer_studies()}
)


def recipe(figure: str) -> Recipe:
    """The recipe of that figure.

    Raises:
        LookupError: there is none; the message names the nearest.
    """
    if figure in RECIPES:
        return RECIPES[figure]
    [nearest] = difflib.get_close_matches(figure, [*RECIPES, TRANSFER], n=1, cutoff=0.0)
    raise LookupError(f"no recipe for {figure!r}; did you mean {nearest!r}? There are {', '.join(RECIPES)}")


def recipes(name: str) -> tuple[Recipe, ...]:
    """The recipes of that name: one of a figure, those of all robots of `transfer`.

    Raises:
        LookupError: there is none; the message names the nearest.
    """
    return transfer_studies() if name == TRANSFER else (recipe(name),)
