"""A dataset: shards in one place that share one identity."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float32, Int64

from workers.dataset import shards
from workers.dataset.chosen import read_chosen, write_chosen
from workers.dataset.identity import Identity
from workers.dataset.manifest import MANIFEST, ensure_manifest, manifest_text
from workers.dataset.schema import Columns, Outcomes, read, read_identity, read_outcomes, read_stops
from workers.dataset.shards import Shard
from workers.dataset.storage.location import Location, fetch
from workers.draws import Draws
from workers.episode import UNUSABLE, Episode


@dataclass(frozen=True)
class Dataset:
    """An open dataset: where it lies, and what it is."""

    folder: Location
    identity: Identity

    def shards(self) -> list[Shard]:
        """The finished shards, in order."""
        return shards.present(self.folder)

    def disjoint(self) -> list[Shard]:
        """The finished shards, in order, of a dataset that holds no episode twice.

        Raises:
            ValueError: two shards overlap, as two runs for different totals at once may leave them.
        """
        found = self.shards()
        for one, next_one in pairwise(found):
            if next_one.start < one.stop:
                raise ValueError(
                    f"{one.name} and {next_one.name} in {self.folder} overlap; remove one of them"
                )
        return found

    def draws(self) -> Draws:
        """How its episodes are drawn.

        Raises:
            ValueError: the file of its first controllers is missing or changed.
        """
        identity = self.identity
        chosen = read_chosen(self.folder, identity.chosen) if identity.chosen else None
        return Draws(identity.seed, identity.repeats, identity.physics_of, chosen)

    def missing(self, episodes: int) -> list[Shard]:
        """The shards still to be collected for that many episodes."""
        return list(shards.missing(self.shards(), episodes, self.identity.episodes_per_shard))

    def episodes(self) -> int:
        """How many episodes the finished shards hold, one that is in two of them once."""
        return shards.episodes_in(self.shards())

    def sane_episodes(self, shard: Shard) -> int:
        """How many episodes of a shard a model may learn from: all but the diverged and the failed ones."""
        stops = read_stops(self.path(shard), self.identity)
        return sum(stop not in UNUSABLE for stop in stops)

    def size(self) -> int:
        """Bytes of the finished shards."""
        files = (path for path in self.folder.iterdir() if any(shards.shard_named(path.name)))
        return sum(path.stat().st_size for path in files)

    def path(self, shard: Shard) -> Location:
        """The file of a shard."""
        return self.folder / shard.name

    def read(self, shard: Shard) -> Columns:
        """The episodes of a shard.

        Raises:
            ValueError: its file is damaged, of another dataset, or holds other episodes than its name says.
        """
        columns = read(fetch(self.path(shard)), self.identity)
        self._require_rows(shard, columns.episode)
        return columns

    def outcomes(self, shard: Shard) -> Outcomes:
        """How the episodes of a shard went; raises as `read` does."""
        outcomes = read_outcomes(self.path(shard), self.identity)
        self._require_rows(shard, outcomes.episode)
        return outcomes

    def _require_rows(self, shard: Shard, episode: Int64[np.ndarray, " n"]) -> None:
        if not np.array_equal(episode, np.arange(shard.start, shard.stop)):
            held = f"{episode[0]} to {episode[-1]}" if len(episode) else "none"
            raise ValueError(
                f"{self.path(shard)} must hold the episodes {shard.start} to {shard.stop - 1} of its name, "
                f"got {held}; was it renamed? `svaedc dataset verify {self.folder}` names every such file, "
                "`svaedc dataset repair` recomputes them"
            )

    def episode(self, index: int) -> Episode:
        """One episode, as it was recorded.

        Raises:
            IndexError: no finished shard holds it; the message names some that there are.
            ValueError: the file that holds it is damaged.
        """
        shard = next((shard for shard in self.shards() if shard.start <= index < shard.stop), None)
        if shard is None:
            held = ", ".join(f"{each.start} to {each.stop - 1}" for each in self.shards()[:4]) or "none"
            raise IndexError(f"{self.folder} holds no episode {index}; its files hold {held}")
        return self.read(shard).row(index - shard.start)

    def fingerprint(self) -> str:
        """SHA-256 over the identity and the recorded digest of every shard: the same for the same bytes."""
        return self.fingerprint_of(self.shards())

    def fingerprint_of(self, present: Sequence[Shard]) -> str:
        """The same, if these were all shards there are: of one look at a folder that may be growing."""
        digest = hashlib.sha256(self.identity.digest.encode())
        for shard, recorded in zip(present, shards.recorded_digests(self.folder, present), strict=True):
            digest.update(f"{shard.name} {recorded}\n".encode())
        return digest.hexdigest()

    def batches(self) -> Iterator[tuple[Shard, Columns]]:
        """Every shard with its episodes, one in memory at a time."""
        for shard in self.shards():
            yield shard, self.read(shard)


def create(folder: Location, identity: Identity, chosen: Float32[np.ndarray, "c d"] | None = None) -> Dataset:
    """Open the dataset in a folder, or begin it there.

    Args:
        folder: of the dataset, made when it is missing.
        identity: what is asked for.
        chosen: controllers that come first, whose digest the identity states; None where all are drawn.

    Returns:
        The open dataset.

    Raises:
        ValueError: when the folder holds a dataset of another identity, naming the fields that differ.
    """
    folder.mkdir(parents=True, exist_ok=True)
    _require_own_shards(folder, identity)
    if chosen is not None and not (folder / MANIFEST).exists():
        write_chosen(folder, chosen)
    dataset = _open(folder, ensure_manifest(folder, manifest_text(identity)))
    refusal = dataset.identity.refusal(identity, folder)
    if refusal:
        raise ValueError(refusal)
    return dataset


def _require_own_shards(folder: Location, identity: Identity) -> None:
    """Refuse shards of another dataset where the manifest is lost; it is written anew beside its own."""
    if (folder / MANIFEST).exists():
        return
    for shard in shards.present(folder)[:1]:
        differences = read_identity(folder / shard.name).differences(identity)
        if differences:
            raise ValueError(
                f"{folder} has lost its {MANIFEST}, and {shard.name} in it and what was asked for differ in "
                + "; ".join(differences)
                + f". Ask for what the file holds, which writes {MANIFEST} anew, or choose another folder"
            )


def open_dataset(folder: Location) -> Dataset:
    """Open an existing dataset.

    Raises:
        ValueError: when the folder holds none, or its manifest is damaged.
    """
    manifest = folder / MANIFEST
    if not manifest.exists():
        raise ValueError(f"{folder} holds no dataset: there is no {MANIFEST} in it")
    return _open(folder, manifest.read_bytes())


def _open(folder: Location, manifest: bytes) -> Dataset:
    try:
        return Dataset(folder, Identity.from_json(manifest.decode()))
    except ValueError as error:
        raise ValueError(
            f"{folder / MANIFEST} is damaged or of another version: {error}. If it is damaged, remove it: "
            "`svaedc collect` with the options of its shards writes it anew"
        ) from error
