"""Whether a folder holds the files of its dataset and no others that could be taken for them."""

from collections.abc import Iterator

from workers.dataset.folder import Dataset
from workers.dataset.manifest import MANIFEST, manifest_text
from workers.dataset.schema import read_identity
from workers.dataset.shards import Shard, missing, readable_sha256, recorded_digest, shard_named
from workers.dataset.storage.location import Location, files
from workers.dataset.storage.temporary import WRITING
from workers.dataset.verification import Defect

_DIGEST = ".sha256"


def inventory(dataset: Dataset) -> Iterator[Defect]:
    """What is wrong with the folder, beside what is in its shards; nothing is changed or deleted."""
    yield from _manifest_problems(dataset)
    for path in files(dataset.folder, "*.parquet"):
        if not list(shard_named(path.name)):
            yield Defect(path.name, f"no shard has such a name, {_whose(dataset, path)}")
    for shard in lost_shards(dataset):
        yield Defect(shard.name, "it is missing: only its .sha256 file is there")
    for shard in leftover_shards(dataset):
        yield Defect(shard.name + _DIGEST, "it is left over: the episodes of its shard are in other files")


def manifest_differences(dataset: Dataset) -> list[str]:
    """What `dataset.json` and the shards differ in, if no shard is of it: it was changed, and not they."""
    found: list[str] = []
    for shard in dataset.shards():
        try:
            differences = dataset.identity.differences(read_identity(dataset.path(shard)))
        except ValueError:
            continue  # a broken file says nothing, and is named elsewhere
        if not differences:
            return []
        found = found or list(differences)
    return found


def lost_shards(dataset: Dataset) -> list[Shard]:
    """Shards of which only the digest is there, and whose episodes are not all in other files.

    They were deleted, or their writer was killed between the two names.
    """
    return [shard for shard, is_covered in _digests_alone(dataset) if not is_covered]


def leftover_shards(dataset: Dataset) -> list[Shard]:
    """Shards of which only the digest is there, while other files hold their episodes."""
    return [shard for shard, is_covered in _digests_alone(dataset) if is_covered]


def sweep_digests(dataset: Dataset) -> int:
    """Remove the digests that killed writers left over; returns how many.

    The file of a writer that is about to finish the shard, on whatever machine, keeps its digest.
    """
    writing = [path.name for path in (dataset.folder / WRITING).glob("*")]
    swept = 0
    for shard in leftover_shards(dataset):
        if not any(name.startswith(f"{shard.name}.") for name in writing):
            (dataset.folder / (shard.name + _DIGEST)).unlink(missing_ok=True)
            swept += 1
    return swept


def _manifest_problems(dataset: Dataset) -> Iterator[Defect]:
    if (dataset.folder / MANIFEST).read_text(encoding="utf-8") != manifest_text(dataset.identity):
        yield Defect(MANIFEST, "it was changed: its text is not the one that `svaedc collect` writes")
    differences = manifest_differences(dataset)
    if differences:
        yield Defect(
            MANIFEST,
            f"no shard belongs to it; they differ in {'; '.join(differences)}. Remove it: `svaedc collect` "
            "with the options of the shards writes it anew",
        )


def _whose(dataset: Dataset, path: Location) -> str:
    """Whether a strange file is a copy; readers of all Parquet files would see its episodes as well."""
    digest = readable_sha256(path)
    for shard in dataset.shards():
        if recorded_digest(dataset.folder, shard) == digest:
            return f"and its bytes are a copy of {shard.name}"
    return "and its bytes are those of no shard here"


def _digests_alone(dataset: Dataset) -> list[tuple[Shard, bool]]:
    """Shards without a file, and whether other files hold all of their episodes.

    All from one look at the folder: a shard that appears meanwhile must not count as one of the others.
    """
    there = {path.name for path in dataset.folder.iterdir()}
    alone = [
        shard
        for name in sorted(there)
        if name.endswith(_DIGEST) and name.removesuffix(_DIGEST) not in there
        for shard in shard_named(name.removesuffix(_DIGEST))
    ]
    present = [shard for name in there for shard in shard_named(name)]
    stop = max((shard.stop for shard in alone), default=0)
    uncovered = list(missing(present, stop, dataset.identity.episodes_per_shard))
    return [
        (shard, not any(shard.start < gap.stop and gap.start < shard.stop for gap in uncovered))
        for shard in alone
    ]
