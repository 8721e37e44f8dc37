"""What a dataset is: everything that decides the bytes of its episodes."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, asdict, dataclass, fields
from importlib.metadata import distributions, version
from typing import Any

from workers.draws import EPISODE, PHYSICS_OF
from workers.plug_ins import file_name
from workers.rollout import VERSION as ROLLOUT_VERSION
from workers.setups import Setup, registry, user_bad
from workers.setups.declared import ABSENT, Change, changes, what_changed

SCHEMA_VERSION = 1
STORAGES = ("float32", "int16")


@dataclass(frozen=True)
class Identity:
    """Two datasets with equal identities hold equal episodes; unequal ones never mix.

    A field with a default came later than the first datasets and is left out of the JSON while it has its
    default: those datasets keep their digest.

    Attributes:
        setup: its name.
        parameters: name, low and high of every controller parameter.
        observation: name, unit, low and high of every channel of ξ.
        conditions: names of the bad conditions.
        horizon: T, control steps.
        control_step: s.
        physics: the interval of every randomised parameter.
        seed: of all controllers and physics.
        episodes_per_shard: how the episodes are cut into files.
        schema_version: of the Parquet columns.
        rollout_version: of the simulation's code.
        pybullet: version.
        numpy: version.
        repeats: R, episodes of each controller, under different physics each.
        bad_kind: `bits`, one per condition and step, or `graded`, a degree per step.
        bad_name: `module:function` of a user's G_bad; "" for the setup's own.
        bad_digest: SHA-256 of the file that defines it.
        setup_digest: SHA-256 of the file of a user's setup; "" for those that ship.
        storage: how ξ is stored: `float32`, or `int16` codes between the bounds of its channels.
        packages: name and version of every further package that decides the bytes of an episode.
        gap: level of hidden physics that they are drawn from, or its ranges; "" for those of the setup's
            data collection.
        physics_of: one of `workers.draws.PHYSICS_OF`, what has physics of its own.
        chosen: SHA-256 of the file of controllers that come first; "" where all are drawn.
    """

    setup: str
    parameters: tuple[tuple[str, float, float], ...]
    observation: tuple[tuple[str, str, float, float], ...]
    conditions: tuple[str, ...]
    horizon: int
    control_step: float
    physics: Mapping[str, tuple[float, float]]
    seed: int
    episodes_per_shard: int
    schema_version: int
    rollout_version: int
    pybullet: str
    numpy: str
    repeats: int = 1
    bad_kind: str = "bits"
    bad_name: str = ""
    bad_digest: str = ""
    setup_digest: str = ""
    storage: str = "float32"
    packages: tuple[tuple[str, str], ...] = ()
    gap: str = ""
    physics_of: str = EPISODE
    chosen: str = ""

    def __post_init__(self) -> None:
        """Refuse shards without episodes, controllers without them, and unknown choices."""
        for name, known in (("storage", STORAGES), ("physics_of", PHYSICS_OF)):
            if getattr(self, name) not in known:
                raise ValueError(f"{name} must be one of {', '.join(known)}, got {getattr(self, name)!r}")
        for name in ("episodes_per_shard", "repeats"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} must be at least 1, got {getattr(self, name)}")

    @property
    def versions(self) -> tuple[tuple[str, str], ...]:
        """Name and version of every package that decides the bytes of an episode."""
        return ("pybullet", self.pybullet), ("numpy", self.numpy), *self.packages

    @property
    def digest(self) -> str:
        """SHA-256 of the identity in canonical JSON."""
        return hashlib.sha256(self.to_json().encode()).hexdigest()

    def to_json(self) -> str:
        """Canonical JSON: sorted keys, no spaces."""
        later = {field.name: field.default for field in fields(self) if field.default is not MISSING}
        values = {name: value for name, value in asdict(self).items() if later.get(name, MISSING) != value}
        return json.dumps(values, sort_keys=True, separators=(",", ":"))

    @classmethod
    def from_json(cls, text: str) -> "Identity":
        """The identity that `to_json` wrote.

        Raises:
            ValueError: when the text is not JSON, or not that of an identity.
        """
        values: dict[str, Any] = json.loads(text)
        try:
            for name in ("parameters", "observation", "packages"):
                values[name] = tuple(tuple(row) for row in values.get(name, ()))
            values["conditions"] = tuple(values["conditions"])
            values["physics"] = {name: tuple(interval) for name, interval in values["physics"].items()}
            return cls(**values)
        except (TypeError, KeyError, AttributeError) as error:
            raise ValueError(f"no identity of a dataset: {error!r}") from error

    def differences(self, other: "Identity") -> tuple[str, ...]:
        """One line for everything in which two identities differ."""
        return tuple(map(str, self._changes(other, [field.name for field in fields(self)])))

    def refusal(self, asked: "Identity", place: object) -> str:
        """Say why a place that holds this dataset is none for another one.

        Args:
            asked: what is to be collected into it.
            place: of this dataset.

        Returns:
            What differs, and what to do; "" when nothing does.
        """
        left = [field.name for field in fields(self)]
        files = []
        for name, digest, kind, declared in _FILES:
            if self._has_changed(asked, name, digest):
                said = what_changed(
                    self._changes(asked, [each for each in declared if each in left]), kind.noun
                )
                file = file_name(getattr(self, name), kind)
                files.append(f"{file} has changed since the dataset in {place} was begun ({said})")
                left = [each for each in left if each not in (digest, *declared)]
        others = "; ".join(map(str, self._changes(asked, left)))
        if files:
            more = f"; it and what was asked for also differ in {others}" if others else ""
            return f"{'; '.join(files)}{more}. Choose another folder, or put the file back as it was"
        if others:
            return (
                f"{place} holds another dataset; it and what was asked for differ in {others}. "
                "Choose another folder, or ask for the same"
            )
        return ""

    def _has_changed(self, asked: "Identity", name: str, digest: str) -> bool:
        """Whether a file of the user's is another version of the one that this dataset was made with."""
        before, now = getattr(self, digest), getattr(asked, digest)
        return getattr(self, name) == getattr(asked, name) and before != now and bool(before and now)

    def _changes(self, other: "Identity", names: Sequence[str]) -> Iterator[Change]:
        """What differs in these fields; of digests, only those of the same file, cut."""
        one, two = ({name: getattr(side, name) for name in names} for side in (self, other))
        for name, digest, kind, _ in _FILES:
            codes = [side.pop(digest, "") for side in (one, two)]
            if codes[0] != codes[1] and getattr(self, name) == getattr(other, name):
                file = file_name(getattr(self, name), kind)
                yield Change(f"the code of {file}", *(code[:12] or ABSENT for code in codes))
        yield from changes(one, two)


_FILES = (
    (
        "setup",
        "setup_digest",
        registry.KIND,
        ("parameters", "observation", "conditions", "horizon", "control_step", "physics", "bad_kind"),
    ),
    ("bad_name", "bad_digest", user_bad.KIND, ("conditions", "bad_kind")),
)
"""Each file of a user's: the fields of its name and of its digest, its kind, and what it declares."""


def identity_of(
    setup: Setup,
    *,
    seed: int,
    episodes_per_shard: int,
    repeats: int = 1,
    storage: str = "float32",
    gap: str = "",
    physics_of: str = EPISODE,
    chosen: str = "",
) -> Identity:
    """Identify a dataset that is collected now, with this code and these libraries.

    Args:
        setup: what is rolled out, under the physics of `gap`.
        seed: of all controllers and physics.
        episodes_per_shard: of a whole file, at least 1.
        repeats: episodes of each controller, at least 1.
        storage: of ξ, one of `STORAGES`.
        gap: name of those physics; "" for those of the setup's data collection.
        physics_of: one of `workers.draws.PHYSICS_OF`, what has physics of its own.
        chosen: SHA-256 of the file of controllers that come first; "" where all are drawn.

    Returns:
        The identity.
    """
    return Identity(
        setup=setup.name,
        parameters=tuple((p.name, p.low, p.high) for p in setup.controller.parameters),
        observation=tuple((c.name, c.unit, c.low, c.high) for c in setup.observation),
        conditions=setup.conditions,
        horizon=setup.horizon,
        control_step=setup.control_step,
        physics=dict(setup.physics.intervals),
        seed=seed,
        episodes_per_shard=episodes_per_shard,
        schema_version=SCHEMA_VERSION,
        rollout_version=ROLLOUT_VERSION,
        pybullet=version(_bullet()),
        numpy=version("numpy"),
        repeats=repeats,
        bad_kind="graded" if setup.task.graded else "bits",
        bad_name=setup.task.bad_name,
        bad_digest=setup.task.bad_digest,
        setup_digest=setup.code,
        storage=storage,
        packages=tuple((name, version(name)) for name in setup.packages),
        gap=gap,
        physics_of=physics_of,
        chosen=chosen,
    )


def _bullet() -> str:
    """The package that has the module: `pybullet`, or `pybullet-arm64` where that has no wheel."""
    return "pybullet" if any(distributions(name="pybullet")) else "pybullet-arm64"
