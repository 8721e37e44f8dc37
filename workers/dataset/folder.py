"""A dataset: a folder of shards that share one identity."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from workers.dataset import shards
from workers.dataset.identity import Identity
from workers.dataset.publication import link, synchronise, temporary_file
from workers.dataset.schema import Columns, read, read_stops
from workers.dataset.shards import Shard
from workers.rollout import DIVERGED, Episode

MANIFEST = "dataset.json"


@dataclass(frozen=True)
class Dataset:
    """An open dataset: where it lies, and what it is."""

    folder: Path
    identity: Identity

    def shards(self) -> list[Shard]:
        """The finished shards, in order."""
        return shards.present(self.folder)

    def require_disjoint(self) -> None:
        """Refuse a dataset that holds episodes twice, as two runs for different totals at once may leave it.

        Raises:
            ValueError: naming two shards that overlap.
        """
        for one, next_one in pairwise(self.shards()):
            if next_one.start < one.stop:
                raise ValueError(
                    f"{one.name} and {next_one.name} in {self.folder} overlap; remove one of them"
                )

    def missing(self, episodes: int) -> list[Shard]:
        """The shards still to be collected for that many episodes."""
        return list(shards.missing(self.shards(), episodes, self.identity.episodes_per_shard))

    def episodes(self) -> int:
        """How many episodes the finished shards hold."""
        return sum(shard.episodes for shard in self.shards())

    def sane_episodes(self) -> int:
        """How many of them a model may learn from: all but the diverged ones."""
        diverged = sum(read_stops(self.path(shard)).count(DIVERGED) for shard in self.shards())
        return self.episodes() - diverged

    def size(self) -> int:
        """Bytes of the finished shards."""
        return sum(self.path(shard).stat().st_size for shard in self.shards())

    def path(self, shard: Shard) -> Path:
        """The file of a shard."""
        return self.folder / shard.name

    def read(self, shard: Shard) -> Columns:
        """The episodes of a shard; a damaged file raises `ValueError`."""
        return read(self.path(shard), self.identity)

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
        digest = hashlib.sha256(self.identity.digest.encode())
        for shard in self.shards():
            digest.update(f"{shard.name} {shards.recorded_digest(self.folder, shard)}\n".encode())
        return digest.hexdigest()

    def batches(self) -> Iterator[tuple[Shard, Columns]]:
        """Every shard with its episodes, one in memory at a time."""
        for shard in self.shards():
            yield shard, self.read(shard)


def create(folder: Path, identity: Identity) -> Dataset:
    """Open the dataset in a folder, or begin it there.

    Raises:
        ValueError: when the folder holds a dataset of another identity, naming the fields that differ.
    """
    folder.mkdir(parents=True, exist_ok=True)
    manifest = folder / MANIFEST
    if not manifest.exists():
        with temporary_file(folder, MANIFEST) as temporary:
            temporary.write_text(manifest_text(identity))
            synchronise(temporary)
            link(temporary, manifest)
    dataset = open_dataset(folder)
    differences = dataset.identity.differences(identity)
    if differences:
        raise ValueError(
            f"{folder} holds another dataset; it and what was asked for differ in "
            + "; ".join(differences)
            + ". Choose another folder, or ask for the same"
        )
    return dataset


def manifest_text(identity: Identity) -> str:
    """The content of `dataset.json`."""
    return json.dumps(json.loads(identity.to_json()), indent=2) + "\n"


def open_dataset(folder: Path) -> Dataset:
    """Open an existing dataset.

    Raises:
        ValueError: when the folder holds none, or its manifest is damaged.
    """
    manifest = folder / MANIFEST
    if not manifest.exists():
        raise ValueError(f"{folder} holds no dataset: there is no {MANIFEST} in it")
    try:
        return Dataset(folder, Identity.from_json(manifest.read_text()))
    except ValueError as error:
        raise ValueError(f"{manifest} is damaged or of another version: {error}") from error
