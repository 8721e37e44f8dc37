"""What the steps of a reproduction cost, from costs of single episodes, updates and suggestions.

They are CPU times of one core, measured as docs/benchmarks.md says; another machine has other ones, and
`svaedc collect --plan` measures those of its own episodes.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final


@dataclass(frozen=True)
class Cost:
    """What something takes.

    Attributes:
        core_seconds: CPU time.
        seconds: wall time on so many cores, if nothing else needs them.
        size: bytes on disk.
    """

    core_seconds: float = 0.0
    seconds: float = 0.0
    size: float = 0.0

    def __add__(self, other: "Cost") -> "Cost":
        """One after the other."""
        return Cost(
            self.core_seconds + other.core_seconds, self.seconds + other.seconds, self.size + other.size
        )


@dataclass(frozen=True)
class _Episode:
    seconds: float
    size: int  # bytes


_EPISODES: Final[Mapping[str, _Episode]] = MappingProxyType(
    {
        "franka": _Episode(0.027, 23_800),
        "yumi": _Episode(0.064, 25_100),
        "yumi-rehearsal": _Episode(0.059, 13_800),
        "daisy-27d": _Episode(0.359, 75_000),
        "daisy-11d": _Episode(0.562, 117_500),
        "daisy-11d-rehearsal": _Episode(0.251, 45_800),
    }
)
_SUGGESTIONS: Final[Mapping[str, float]] = MappingProxyType(
    {"random": 0.0, "screened-random": 0.0, "matern": 0.083, "se-acqf": 0.165, "botorch": 0.35, "bbk-kl": 0.1}
)
_USUAL_SUGGESTION = 0.05  # s, of a method that searches its pool, at 22 trials
_BEGINNINGS: Final[Mapping[str, float]] = MappingProxyType({"bbk-kl": 3.6})
_UPDATES: Final[Mapping[tuple[str, str, str], float]] = MappingProxyType(
    {
        ("franka", "compact", "3x3"): 0.037,
        ("franka", "compact", "5x6"): 0.058,
        ("yumi", "compact", "3x3"): 0.059,
        ("daisy-27d", "compact", "3x3"): 0.069,
        ("daisy-11d", "compact", "3x3"): 0.086,
        ("franka", "paper", "3x3"): 0.45,
        ("franka", "paper", "5x6"): 2.1,
        ("yumi", "paper", "3x3"): 0.69,
        ("daisy-27d", "paper", "3x3"): 0.99,
        ("daisy-11d", "paper", "3x3"): 1.9,
    }
)
_ROW = 400  # bytes of one trial in its run's record


def collecting(setup: str, episodes: int, cores: int) -> Cost:
    """Rolling out and storing episodes."""
    one = _EPISODES[setup]
    seconds = one.seconds * episodes
    return Cost(seconds, seconds / cores, float(one.size * episodes))


def training(setup: str, preset: str, latent: str, updates: int, cache: int) -> Cost:
    """Gradient updates, on one thread; a GPU or further threads make them faster.

    Args:
        setup: whose episodes.
        preset: of training.
        latent: size of the latent path.
        updates: of all stages.
        cache: bytes of the decoded episodes.
    """
    seconds = _UPDATES[setup, preset, latent] * updates
    return Cost(seconds, seconds, float(cache))


def comparing(setup: str, methods: Iterable[str], runs: Mapping[str, float], trials: int, slots: int) -> Cost:
    """Simulated runs, with what their methods think between trials.

    Args:
        setup: whose trials; one without a simulator costs nothing.
        methods: compared.
        runs: still to be done of each method; a part of one counts as such.
        trials: of a run, the random ones included.
        slots: runs at the same time.
    """
    episode = _EPISODES[setup].seconds if setup in _EPISODES else 0.0
    seconds = sum(
        runs[name]
        * (_BEGINNINGS.get(name, 0.0) + trials * (episode + _SUGGESTIONS.get(name, _USUAL_SUGGESTION)))
        for name in methods
    )
    return Cost(seconds, seconds / slots, sum(runs.values()) * trials * _ROW)
