"""Figures of the paper asked again of robots in another engine, which no model has seen."""

from dataclasses import replace

from cluster.reproduction.recipe import Recipe

OTHER_ENGINE = "mujoco"
"""Setups of this engine end in it; models are trained on PyBullet's."""


def in_other_engine(recipe: Recipe, panel: str) -> Recipe:
    """Ask what a panel shows of robots in another engine, with hidden physics of the level `wide`.

    Data, model, methods, runs and trials stay those of the figure. Its claims are asked again: whether they
    carry over to robots that the simulation is not.

    Args:
        recipe: of the figure.
        panel: name of the one that is asked.

    Returns:
        A recipe of that panel alone, whose name ends in the engine.

    Raises:
        LookupError: the figure has no such panel.
    """
    found = [each for each in recipe.panels if each.name == panel]
    if not found:
        known = ", ".join(each.name for each in recipe.panels)
        raise LookupError(f"{recipe.figure} has no panel {panel!r}; there are {known}")
    [asked] = found
    there = replace(
        asked,
        title=f"{asked.title}, robots in MuJoCo",
        setup=f"{asked.setup}-{OTHER_ENGINE}",
        gap="wide",
    )
    return replace(
        recipe,
        figure=f"{recipe.figure}-{OTHER_ENGINE}",
        title=f"{recipe.title}, model of PyBullet and robots in MuJoCo",
        panels=(there,),
        claims=tuple(
            claim for claim in recipe.claims if all(evidence.panel == panel for evidence in claim.evidence)
        ),
    )
