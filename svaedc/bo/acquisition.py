"""Where the acquisition is largest: among the candidates of a pool, or anywhere, by gradients."""

import math
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, Protocol, runtime_checkable

import numpy as np
import torch
from botorch.acquisition.acquisition import AcquisitionFunction
from botorch.exceptions.warnings import BotorchWarning
from botorch.models.deterministic import GenericDeterministicModel
from botorch.optim.optimize import optimize_acqf
from jaxtyping import Float, Float32
from torch import Tensor

from svaedc.bo.candidates import Candidates
from svaedc.bo.history import History

RESTARTS: Final = 5
RAW_SAMPLES: Final = 256
"""`optimize_acqf` draws so many points, and starts from the most promising ones."""
ITERATIONS: Final = 200
"""L-BFGS takes at most so many from each of them."""
BLOCK: Final = 1_000
"""So many candidates are valued at once: intermediate results stay in the processor's caches."""
DRAWS: Final = 64
"""The first allowed one of so many random controllers is taken."""
_PENALTY: Final = 1e3
"""A unit of predicted badness beyond what is allowed costs so much; acquisitions are of the order of 1."""
_TOLERANCE: Final = 1e-2

Value = Callable[[Tensor], Tensor]
"""It returns the acquisition [*batch, n] at features [*batch, n, k], each on its own."""


@runtime_checkable
class Search(Protocol):
    """A way to maximise an acquisition; every method works with every one."""

    def anywhere(
        self, candidates: Candidates, history: History, rng: np.random.Generator
    ) -> Float32[np.ndarray, " D"]:
        """Draw a controller for a trial before which nothing is known.

        Args:
            candidates: What may be suggested, with features and bounds.
            history: Trials of the run so far.
            rng: Generator of the trial.

        Returns:
            Controller, [D], in the unit cube.
        """
        ...

    def maximize(
        self, value: Value, candidates: Candidates, history: History, rng: np.random.Generator
    ) -> Float32[np.ndarray, " D"]:
        """Seek the controller of largest value that is worth a trial.

        Args:
            value: Acquisition to maximise, of features.
            candidates: What may be suggested, with features and bounds.
            history: Trials of the run so far.
            rng: Generator of the trial.

        Returns:
            Controller, [D], in the unit cube.
        """
        ...


class OverPool:
    """Search among the candidates, whose features are known."""

    def anywhere(
        self, candidates: Candidates, history: History, rng: np.random.Generator
    ) -> Float32[np.ndarray, " D"]:
        """Draw uniformly from the candidates no trial was spent on.

        Args:
            candidates: A pool, at least one of them untried.
            history: Trials of the run so far.
            rng: Generator of the trial.

        Returns:
            Candidate, [D], a copy.
        """
        return candidates.x[rng.choice(candidates.untried_indices(history))].copy()

    def maximize(
        self,
        value: Value,
        candidates: Candidates,
        history: History,
        rng: np.random.Generator,  # noqa: ARG002
    ) -> Float32[np.ndarray, " D"]:
        """Take the untried candidate of largest value.

        Args:
            value: Acquisition to maximise, of features.
            candidates: A pool, at least one of them untried.
            history: Trials of the run so far.
            rng: Not used: the pool is searched as a whole.

        Returns:
            Candidate, [D], a copy.
        """
        untried = candidates.untried_indices(history)
        cuts = range(BLOCK, len(untried), BLOCK)
        with torch.no_grad():
            best = torch.cat([value(candidates.phi[block]) for block in np.split(untried, cuts)]).argmax()
        return candidates.x[untried[best]].copy()


class ByGradient:
    """BoTorch's `optimize_acqf`: multi-start gradient search between the candidates' bounds."""

    def anywhere(
        self,
        candidates: Candidates,
        history: History,  # noqa: ARG002
        rng: np.random.Generator,
    ) -> Float32[np.ndarray, " D"]:
        """Draw uniformly between the bounds, until a controller is not predicted too bad.

        Args:
            candidates: What may be suggested, with features and bounds.
            history: Not used: no draw repeats itself.
            rng: Generator of the trial.

        Returns:
            The first allowed one of `DRAWS` controllers, [D], or else the least bad.
        """
        low, high = candidates.low.numpy(), candidates.high.numpy()
        x = (low + (high - low) * rng.random((DRAWS, len(low)))).astype(np.float32)
        with torch.no_grad():
            first_allowed = candidates.excess(torch.tensor(x).double()).argmin()
        return x[first_allowed]

    def maximize(
        self, value: Value, candidates: Candidates, history: History, rng: np.random.Generator
    ) -> Float32[np.ndarray, " D"]:
        """Seek the controller of largest value, or draw one where that is too bad or was tried already.

        A trial under the same physics would repeat its outcome, and one that failed taught the surrogate
        nothing: it would be asked for again and again.

        Args:
            value: Acquisition to maximise, of features.
            candidates: What may be suggested, with features and bounds.
            history: Trials of the run so far.
            rng: Draws starting points, and the random controller.

        Returns:
            Controller, [D], in the unit cube.
        """
        with torch_randomness(rng), warnings.catch_warnings():
            # A flat acquisition, as after equal outcomes, makes BoTorch warn of every starting point.
            for category in (BotorchWarning, RuntimeWarning):
                warnings.simplefilter("ignore", category)
            best, _ = optimize_acqf(
                _OnControllers(value, candidates),
                torch.stack([candidates.low, candidates.high]),
                q=1,
                num_restarts=RESTARTS,
                raw_samples=RAW_SAMPLES,
                options={"maxiter": ITERATIONS},
            )
        x = best[0].numpy().astype(np.float32)
        forbidden = float(candidates.excess(best).detach()) > _TOLERANCE
        repeated = (history.tried.astype(np.float32) == x).all(axis=1).any()
        return self.anywhere(candidates, history, rng) if forbidden or repeated else x


class _OnControllers(AcquisitionFunction):
    """The acquisition as a function of controllers, with a wall around those predicted too bad."""

    def __init__(self, value: Value, candidates: Candidates) -> None:
        super().__init__(model=GenericDeterministicModel(candidates.features_of))
        self.value = value
        self.candidates = candidates

    def forward(self, x: Tensor) -> Tensor:
        """Values [b] of controllers [b, 1, D], as BoTorch calls it."""
        x = x.squeeze(-2)
        return self.value(self.candidates.features_of(x)) - _PENALTY * self.candidates.excess(x)


@contextmanager
def torch_randomness(rng: np.random.Generator) -> Iterator[None]:
    """Inside, torch draws from `rng`; afterwards, its global state is what it was."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(int(rng.integers(2**63)))
        yield


BETA: Final = 1.0
"""This is the weight of the variance in UCB (section 6 of the paper)."""

Acquisition = Callable[[Tensor, Tensor, float], Tensor]
"""It values a controller by the mean and standard deviation of its f, and by the largest f measured."""

_FAR_BELOW: Final = -1e3
"""Below, 1 - |z| sqrt(pi/2) erfcx(|z|/sqrt 2) is 1/z^2 to rounding, and the difference would cancel."""


def ucb(mu: Float[Tensor, "*n"], sigma: Float[Tensor, "*n"], best: float) -> Float[Tensor, "*n"]:  # noqa: ARG001
    r"""UCB(x) = \mu(x) + \sqrt\beta \sigma(x) with beta = 1, the root as in BoTorch.

    Args:
        mu: Mean of f, [*n].
        sigma: Its standard deviation, [*n].
        best: Not used: UCB compares with nothing.

    Returns:
        Values, [*n], in the unit of f.
    """
    return mu + BETA**0.5 * sigma


def mean(mu: Float[Tensor, "*n"], sigma: Float[Tensor, "*n"], best: float) -> Float[Tensor, "*n"]:  # noqa: ARG001
    r"""\mu(x): what is expected, without a bonus for what is uncertain.

    Args:
        mu: Mean of f, [*n].
        sigma: Not used.
        best: Not used.

    Returns:
        Values, [*n], in the unit of f.
    """
    return mu


def log_ei(mu: Float[Tensor, "*n"], sigma: Float[Tensor, "*n"], best: float) -> Float[Tensor, "*n"]:
    r"""LogEI(x) = log E[max(f(x) - best, 0)] = log \sigma + log h(z) with z = (\mu - best) / \sigma.

    Its logarithm, because expected improvement itself is zero in floating point almost everywhere after a few
    trials (Ament et al., NeurIPS 2023).

    Args:
        mu: Mean of f, [*n].
        sigma: Its standard deviation, above 0, [*n].
        best: Largest objective measured.

    Returns:
        Values, [*n], finite also where expected improvement would round to 0.
    """
    return sigma.log() + _log_h((mu - best) / sigma)


def _log_h(z: Tensor) -> Tensor:
    r"""log(\varphi(z) + z \Phi(z)), exact to rounding for every z; each branch sees only its own z."""
    near, middle, far = z > -1, (z <= -1) & (z > _FAR_BELOW), z <= _FAR_BELOW
    z_near, z_middle, z_far = (
        torch.where(branch, z, inside)
        for branch, inside in ((near, 0.0), (middle, -2.0), (far, 2 * _FAR_BELOW))
    )
    log_near = (torch.exp(_log_phi(z_near)) + z_near * torch.special.ndtr(z_near)).log()
    ratio = z_middle * math.sqrt(math.pi / 2) * torch.special.erfcx(-z_middle / math.sqrt(2))
    log_middle = _log_phi(z_middle) + torch.log1p(ratio)
    log_far = _log_phi(z_far) - 2 * torch.log(-z_far)
    return torch.where(near, log_near, torch.where(middle, log_middle, log_far))


def _log_phi(z: Tensor) -> Tensor:
    return -0.5 * z.square() - 0.5 * math.log(2 * math.pi)
