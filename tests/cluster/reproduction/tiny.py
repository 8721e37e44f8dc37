"""A figure small enough for tests, and its reproductions."""

import torch

from cluster.config import Settings
from cluster.reproduction.cost import cost_items
from cluster.reproduction.plan import SCALES, resolve
from cluster.reproduction.recipe import Panel, Recipe
from svaedc.analysis.evidence import Claim, Successes
from svaedc.analysis.paired_evidence import Gain
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc
from svaedc.training.presets import Sizes, compact, vary

TINY = Recipe(
    "figure-0",
    "a walk",
    data="franka",
    runs=2,
    panels=(Panel("push", "a push", "franka-rehearsal", ("random", "svae-dc"), trials=2, gap="wide"),),
    claims=(
        Claim("better", "section 0", (Gain("push", "svae-dc", "random", 2),)),
        Claim("often", "section 0", (Successes("push", "svae-dc", "runs", 0.0, 1.0),)),
    ),
)


def plan_of(recipe, folder, dataset=None, models=(), episodes=300, runs=2):
    return resolve(
        recipe, SCALES["machine"], folder, episodes=episodes, runs=runs, dataset=dataset, models=tuple(models)
    )


def untrained(folder, setup="franka", latent="3x3"):
    torch.manual_seed(0)
    folder.mkdir()
    model = SvaeDc(vary(compact(Sizes(48, 25, 100)), {"latent": latent}).model)
    checkpoint.save(folder / "model.pt", model, {"setup": setup})
    return folder


def costs(reproduction, settings=Settings()):  # noqa: B008 - settings never change
    return {item.step.split(":")[0]: item.cost for item in cost_items(reproduction, settings, 2)}
