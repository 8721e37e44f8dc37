"""The methods that ship, by name: what each is, and what may stand behind its name; light to import."""

import difflib
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Final

RANDOM: Final = {
    "random": "uniform in the unit cube",
    "screened-random": "uniform among the controllers that the model predicts least bad",
}
CONTROLLERS: Final = {
    "se": "Bayesian optimisation on the controllers, squared-exponential kernel",
    "matern": "Bayesian optimisation on the controllers, Matérn-5/2 kernel",
    "botorch": "BoTorch's own single-task process, on the controllers",
    "saasbo": "BoTorch's sparse axis-aligned process, on the controllers; seconds per suggestion",
    "turbo": "TuRBO-1, in a trust region around the best controller",
}
LATENT: Final = {
    "svae": "on the latent paths of an SVAE, squared-exponential kernel",
    "svae-matern": "on the latent paths of an SVAE, Matérn-5/2 kernel",
    "svae-dc": "on latent paths that are compressed where badness is predicted, equation (k_svae_dc)",
    "svae-dc-matern": "svae-dc with the Matérn-5/2 kernel",
    "svae-dc-sigmoid": "svae-dc with a sigmoid of the badness",
    "svae-dc-whitened": "svae-dc with every latent dimension in units of its spread",
    "svae-dc-online": "svae-dc with a sigmoid, and the model's last layers fitted to the trials",
    "screened-svae": "on latent paths, among the controllers predicted least bad",
    "bbk-kl": "by the divergence between the trajectories that the model expects",
    "lkl": "by the divergence between the latent paths that the model expects",
}
"""These need a trained model."""
SIMULATED: Final = {
    "simulated-random": "uniform among the candidates that were simulated",
    "simulated-best": "candidates in the order of their mean simulated objective",
    "simulated-cautious": "candidates in the order of their mean simulated objective minus its spread",
    "least-bad": "candidates in the order of their mean simulated badness",
}
PRIORS: Final = {
    "prior-se": "Bayesian optimisation on the controllers, with the simulated objective as prior mean",
    "prior-svae": "the same on latent paths",
    "prior-svae-dc": "the same on compressed latent paths",
    "ensemble-se": "the robot as one more of the simulated worlds, what no world shows on the controllers",
    "ensemble-svae": "the same on latent paths",
    "ensemble-svae-dc": "the same on compressed latent paths",
    "residual-svae": "the simulated objective, corrected by trials of candidates that do nearly the same",
    "residual-svae-dc": "the same on compressed latent paths",
}
"""These need candidates that were simulated."""
VARIANTS: Final = {
    "se-acqf": "se, searched by gradients instead of in a pool",
    "matern-acqf": "matern, searched by gradients instead of in a pool",
}
SUMMARIES: Final[Mapping[str, str]] = dict(
    sorted((RANDOM | SIMULATED | CONTROLLERS | LATENT | PRIORS | VARIANTS).items())
)
"""These are the methods of the comparison; most take a search and an acquisition behind their name."""
SEARCHES: Final = ("pool", "acqf")
ACQUISITIONS: Final = ("ucb", "ei", "mean")
_OURS, _PRACTITIONERS = ("pool", "ucb"), ("acqf", "ei")
_NEARBY: Final = ("pool", "mean")
_DEFAULTS: Final = (
    dict.fromkeys(CONTROLLERS | LATENT | PRIORS, _OURS)
    | dict.fromkeys(("botorch", "saasbo", "turbo"), _PRACTITIONERS)
    | dict.fromkeys(("residual-svae", "residual-svae-dc"), _NEARBY)
)


@dataclass(frozen=True)
class MethodName:
    """A method's name, read: `svae-dc-acqf-ei` is `svae-dc` by gradients with expected improvement.

    Attributes:
        base: the method without what stands behind it.
        search: one of `SEARCHES`; "" where there is none.
        acquisition: one of `ACQUISITIONS`; "" where there is none.
    """

    base: str
    search: str
    acquisition: str

    @classmethod
    def read(cls, name: str) -> "MethodName":
        """The parts of a name; what it leaves out is the default of its method.

        Raises:
            LookupError: No method that ships has this name, or it has a shorter one.
        """
        base, acquisition = _without_suffix(name, ACQUISITIONS)
        base, search = _without_suffix(base, SEARCHES)
        if name in RANDOM | SIMULATED:
            return cls(name, "", "")
        if base not in _DEFAULTS:
            raise LookupError(_unknown(name))
        usual_search, usual_acquisition = _DEFAULTS[base]
        if search == usual_search or acquisition == usual_acquisition:
            raise LookupError(
                f"method must not repeat what {base!r} does anyway ({usual_search}, {usual_acquisition}), "
                f"got {name!r}: leave that part out"
            )
        return cls(base, search or usual_search, acquisition or usual_acquisition)

    @property
    def needs_model(self) -> bool:
        """Whether it needs the latents of a trained model."""
        on_paths = self.base in PRIORS and "svae" in self.base
        return self.base in LATENT or on_paths or self.base == "screened-random"

    @property
    def needs_candidates(self) -> bool:
        """Whether it needs candidates that were simulated."""
        return self.base in SIMULATED | PRIORS


def ships(name: str) -> bool:
    """Whether a name is one of a method that ships, or would be but for a part that its method has anyway."""
    base, _ = _without_suffix(_without_suffix(name, ACQUISITIONS)[0], SEARCHES)
    return name in RANDOM | SIMULATED or base in _DEFAULTS


def names() -> tuple[str, ...]:
    """The methods of the comparison. Most also take `-pool` or `-acqf`, then `-ucb`, `-ei` or `-mean`."""
    return tuple(SUMMARIES)


def needs_model(name: str) -> bool:
    """Whether a method needs the latents of a trained model.

    Raises:
        LookupError: No method that ships has this name.
    """
    return MethodName.read(name).needs_model


def needs_candidates(name: str) -> bool:
    """Whether a method needs candidates that were simulated.

    Raises:
        LookupError: No method that ships has this name.
    """
    return MethodName.read(name).needs_candidates


def _without_suffix(name: str, suffixes: Collection[str]) -> tuple[str, str]:
    base, _, last = name.rpartition("-")
    return (base, last) if last in suffixes else (name, "")


def _unknown(name: str) -> str:
    nearest = difflib.get_close_matches(name, names(), n=1, cutoff=0.0)[0]
    return f"method must be one of {', '.join(names())}, got {name!r}: did you mean {nearest!r}?"
