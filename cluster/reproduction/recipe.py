"""What a figure of the paper is made from: its comparisons, their data and models, and what was claimed."""

from dataclasses import dataclass
from typing import NamedTuple

from svaedc.analysis.evidence import Claim
from svaedc.bo import methods
from workers.hardware import robots

NINE, THIRTY = "3x3", "5x6"
"""These are latent spaces, steps x dimensions: the paper's usual one, and its larger one (section 7.1)."""


class Training(NamedTuple):
    """A model that is trained for a figure.

    Attributes:
        latent: size of its latent path.
        seed: of its training.
    """

    latent: str
    seed: int = 0

    @property
    def name(self) -> str:
        """Of its folder, after what it learns from."""
        return f"{self.latent}-seed-{self.seed}" if self.seed else self.latent


@dataclass(frozen=True)
class Panel:
    """One comparison of a figure.

    Attributes:
        name: of its folder.
        title: what it shows.
        setup: whose trials are run.
        methods: compared.
        trials: suggested in each run.
        gap: level of the hidden physics.
        latent: size of the model's latent path; "" for methods that need no model.
        candidates: setups in which candidates are simulated before the trials; none where each run draws a
            pool of its own.
        models: of as many training seeds, with which the runs take turns.
        pool: controllers that each run chooses among, drawn anew for every run; 0 for the setting's.
    """

    name: str
    title: str
    setup: str
    methods: tuple[str, ...]
    trials: int = 20
    gap: str = "paper"
    latent: str = NINE
    candidates: tuple[str, ...] = ()
    models: int = 1
    pool: int = 0

    def __post_init__(self) -> None:
        """Refuse methods that lack their model or their candidates."""
        lacking = [name for name in self.methods if methods.needs_candidates(name)]
        if lacking and not self.candidates:
            raise ValueError(f"panel {self.name!r} needs candidates for {', '.join(lacking)}, got none")
        needy = [name for name in self.methods if methods.needs_model(name)]
        if needy and not self.latent:
            raise ValueError(f"panel {self.name!r} needs a latent size for {', '.join(needy)}, got none")

    @property
    def trainings(self) -> tuple[Training, ...]:
        """Of its models, in the order in which runs take turns; none without a latent size."""
        return tuple(Training(self.latent, seed) for seed in range(self.models)) if self.latent else ()

    @property
    def stands_in(self) -> bool:
        """Whether a simulation takes the place of the paper's robot."""
        return bool(robots.stands_in_for(self.setup))

    @property
    def label(self) -> str:
        """Its title, and that it is a stand-in."""
        return _label(self.title, stands_in=self.stands_in)


@dataclass(frozen=True)
class Recipe:
    """A figure of the paper.

    Attributes:
        figure: its name.
        title: what it shows.
        data: setup that episodes are collected of; "" without a model.
        runs: of each method, as in the paper.
        panels: its comparisons.
        claims: what the paper says of it, and controls of this project.
    """

    figure: str
    title: str
    data: str
    runs: int
    panels: tuple[Panel, ...]
    claims: tuple[Claim, ...]

    def __post_init__(self) -> None:
        """Refuse models without data, and claims about what is not compared."""
        if any(panel.latent for panel in self.panels) and not self.data:
            raise ValueError(f"{self.figure} needs data for its models, got none")
        known = {panel.name for panel in self.panels}
        for claim in self.claims:
            for evidence in claim.evidence:
                if evidence.panel not in known:
                    raise ValueError(f"{self.figure} has no panel {evidence.panel!r}: {claim.text}")

    @property
    def trainings(self) -> tuple[Training, ...]:
        """Of the models it needs, each once."""
        return tuple(dict.fromkeys(training for panel in self.panels for training in panel.trainings))

    @property
    def stands_in(self) -> bool:
        """Whether a simulation takes the place of the paper's robot anywhere in it."""
        return any(panel.stands_in for panel in self.panels)

    @property
    def label(self) -> str:
        """Its title, and that it is a stand-in."""
        return _label(self.title, stands_in=self.stands_in)


def _label(title: str, *, stands_in: bool) -> str:
    return f"{title} ({robots.STAND_IN})" if stands_in else title
