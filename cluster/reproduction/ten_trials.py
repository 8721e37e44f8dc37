"""The study of ten trials: what is best tried on robots that are not the simulation, and what kernels add."""

from typing import Final

from cluster.reproduction.recipe import Panel, Recipe
from cluster.reproduction.transfer import OTHER_ENGINE
from svaedc.analysis.evidence import Claim, FewerBroken
from svaedc.analysis.paired_evidence import Gain

TRANSFER: Final = "transfer"
"""The studies of all robots have this name."""
TRAININGS: Final = 2
"""Runs take turns with models of so many training seeds, so that intervals speak of trainings as well."""

LEARNT: Final = ("random", "se", "screened-random", "svae", "svae-dc", "screened-svae")
"""These know of candidates at most what a network expects of x."""
SIMULATED: Final = (
    "simulated-random",
    "simulated-best",
    "simulated-cautious",
    "least-bad",
    "se",
    "svae-dc",
    "screened-svae",
    "prior-se",
    "prior-svae-dc",
    "ensemble-se",
    "residual-svae-dc",
)
"""These choose among candidates that were simulated in PyBullet, under physics of the level `wide`."""
POOL: Final = 500
"""Each run has so many of the simulated candidates: with all of them, every run would share the luck of one
best candidate."""
RECOMMENDED: Final = "residual-svae-dc"
"""It was chosen on tuning seeds, before the study."""

_ROBOTS: Final = {"franka": "franka", "yumi": "yumi", "daisy": "daisy-27d"}
_HIDDEN: Final = (
    (OTHER_ENGINE, f"-{OTHER_ENGINE}", "wide", "MuJoCo, physics of the level wide"),
    ("wide", "", "wide", "same engine, physics of the level wide"),
    ("paper", "", "paper", "same engine, physics within 5 to 10 %"),
)


def transfer_studies() -> tuple[Recipe, ...]:
    """The study of each robot."""
    return tuple(_study(robot, setup) for robot, setup in _ROBOTS.items())


def _study(robot: str, setup: str) -> Recipe:
    panels = (
        panel
        for name, ending, gap, title in _HIDDEN
        for panel in (
            Panel(
                f"{name}-learnt",
                f"{title}; learnt features",
                setup + ending,
                LEARNT,
                gap=gap,
                models=TRAININGS,
            ),
            Panel(
                f"{name}-simulated",
                f"{title}; simulated candidates",
                setup + ending,
                SIMULATED,
                gap=gap,
                candidates=(setup,),
                models=TRAININGS,
                pool=POOL,
            ),
        )
    )
    return Recipe(
        f"{TRANSFER}-{robot}",
        f"Ten trials on {setup}, hidden in three ways",
        data=setup,
        runs=50,
        panels=tuple(panels),
        claims=_claims(),
    )


def _claims() -> tuple[Claim, ...]:
    other = f"{OTHER_ENGINE}-simulated"
    return (
        Claim(
            "svae-dc with learnt features is better than random and than screening, as in the paper's gap",
            "section 7.1",
            tuple(
                Gain("paper-learnt", "svae-dc", baseline, after)
                for after in (10, 20)
                for baseline in ("random", "screened-random")
            ),
        ),
        Claim(
            "svae-dc with simulated features is better than random choice among the same candidates",
            "control",
            tuple(
                Gain(f"{name}-simulated", "svae-dc", "simulated-random", after)
                for name, *_ in _HIDDEN
                for after in (10, 20)
            ),
        ),
        Claim(
            "the order of the mean simulated objective is better than random choice, in another engine too",
            "control",
            tuple(
                Gain(f"{name}-simulated", "simulated-best", "simulated-random", 10) for name, *_ in _HIDDEN
            ),
        ),
        Claim(
            "what is recommended is better than that order, in another engine",
            "control",
            tuple(Gain(other, RECOMMENDED, "simulated-best", after) for after in (5, 10, 20)),
        ),
        Claim(
            "or it breaks two thirds as many trials",
            "control",
            (FewerBroken(other, RECOMMENDED, "simulated-best", 2 / 3),),
        ),
    )
