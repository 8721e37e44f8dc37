"""From a campaign's identity to what decides its controllers, and to what its model expects of them."""

import hashlib
from dataclasses import dataclass
from importlib.metadata import version
from itertools import count
from pathlib import Path

import numpy as np
import torch
from jaxtyping import Float, Float32

from cluster.errors import UserError
from cluster.hardware.identity import CampaignIdentity
from cluster.inputs import usage_errors
from cluster.optimization import methods
from cluster.optimization.candidates import CandidateTable, read
from cluster.optimization.factory import Optimization
from cluster.optimization.models import trained_model
from svaedc.bo.features import Latents
from svaedc.bo.history import History
from svaedc.bo.strategies import Avoidance
from svaedc.model.svae_dc import SvaeDc
from workers.setups import Setup

LIBRARIES = ("numpy", "torch", "gpytorch", "botorch")


@dataclass(frozen=True)
class Proposals:
    """Where the controllers of a campaign come from.

    Attributes:
        optimization: decides them, together with what was measured.
        method: suggests those after the first, far from what failed or was rejected.
        latents: of the model; None for a method without one.
    """

    optimization: Optimization
    method: Avoidance
    latents: Latents | None
    distance: float = 0.0

    @classmethod
    def of(
        cls, identity: CampaignIdentity, setup: Setup, model: Path | None, candidates: Path | None = None
    ) -> "Proposals":
        """Builds the method from the campaign's identity alone, so that every process builds the same.

        Args:
            identity: of the campaign.
            setup: of its robot.
            model: checkpoint; None for a method without one.
            candidates: table of simulated ones; None where the campaign draws its own.

        Returns:
            The proposals.

        Raises:
            UserError: when there is no such method, the model is missing, damaged, or another setup's, or the
                candidates are not those that the campaign was planned with.
        """
        needs_model = methods.needs_model(identity.method)
        optimization = Optimization(
            setup,
            identity.method,
            identity.seed,
            identity.pool,
            _network(identity, model) if needs_model else None,
            identity.draws,
            _candidates(identity, candidates),
            identity.model,
        )
        problem = optimization.problem()
        with usage_errors():
            method = methods.build(identity.method, problem)
        avoiding = Avoidance(method, problem.pool, identity.avoid)
        return cls(optimization, avoiding, problem.latents)

    def random(self, history: History, index: int) -> Float32[np.ndarray, " D"]:
        """The random controller of one of the first trials.

        Args:
            history: what was tried.
            index: of the trial.

        Returns:
            A point of the unit cube, [D]: the first from that index on that is neither tried already nor near
            one that failed or was rejected.
        """
        with usage_errors():
            return self.method.first(history, map(self.optimization.initial, count(index)))

    def suggest(self, history: History, index: int) -> Float32[np.ndarray, " D"]:
        """The next controller.

        Args:
            history: what was measured.
            index: of the trial.

        Returns:
            A point of the unit cube, [D].
        """
        with usage_errors():
            return self.method.suggest(history, self.optimization.rng(index))

    def predict(self, x: Float[np.ndarray, " D"]) -> float | None:
        """Badness of x as the model expects it, in [0, 1]; None without a model."""
        if self.latents is None:
            return None
        return float(self.latents.means(torch.tensor(x[None]))[1])


def fingerprint(path: Path | None) -> str:
    """SHA-256 of a checkpoint, or of a table of candidates; "" for none.

    Raises:
        UserError: when the file cannot be read.
    """
    if path is None:
        return ""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise UserError(
            f"cannot read the model or candidates {path}: {error.strerror}; name the folder that "
            "`svaedc train` or `svaedc candidates` left"
        ) from error


def library_versions() -> dict[str, str]:
    """Versions of the libraries whose arithmetic a proposal depends on."""
    return {library: version(library) for library in LIBRARIES}


def _candidates(identity: CampaignIdentity, candidates: Path | None) -> CandidateTable | None:
    if fingerprint(candidates) != identity.candidates:
        raise UserError(
            f"the candidates {candidates or '(none)'} are not those that this campaign was planned with: "
            "name the same folder with --candidates, or restore the table in it"
        )
    return read(candidates) if candidates is not None else None


def _network(identity: CampaignIdentity, model: Path | None) -> SvaeDc:
    if model is None:
        raise UserError(f"method {identity.method!r} needs a trained model, got none; give one with --model")
    if fingerprint(model) != identity.model:
        raise UserError(f"the model {model} is not the one this campaign was planned with; restore that file")
    return trained_model(model, identity.setup).model
