"""Whose file it is: the identity of its dataset, which every file has in its metadata."""

from collections.abc import Mapping

from workers.dataset.identity import Identity
from workers.dataset.storage.location import Location

IDENTITY_TEXT = "svaedc.identity"
IDENTITY_DIGEST = "svaedc.digest"
"""A file's metadata hold the identity of its dataset under the first name, its digest under the second."""


def identity_in(path: Location, metadata: Mapping[bytes, bytes]) -> Identity:
    """Find the identity in the metadata of a file.

    Args:
        path: of the file, for the error.
        metadata: of the file.

    Returns:
        The identity of the file's dataset.

    Raises:
        ValueError: they hold none.
    """
    if IDENTITY_TEXT.encode() not in metadata:
        raise ValueError(f"{path} holds no episodes of this project: its metadata lacks {IDENTITY_TEXT}")
    return Identity.from_json(metadata[IDENTITY_TEXT.encode()].decode())


def require_own(path: Location, metadata: Mapping[bytes, bytes], identity: Identity) -> None:
    """Refuse a file that was copied from another dataset: its columns may be the same, its episodes are not.

    Args:
        path: of the file, for the error.
        metadata: of the file.
        identity: of the dataset in whose folder it lies.

    Raises:
        ValueError: naming what differs.
    """
    if metadata.get(IDENTITY_DIGEST.encode()) == identity.digest.encode():
        return
    differences = identity_in(path, metadata).differences(identity)
    if differences:
        raise ValueError(
            f"{path} belongs to another dataset; it and the folder differ in {'; '.join(differences)}. "
            f"`svaedc dataset verify {path.parent}` names every such file, `svaedc dataset repair` "
            "recomputes them"
        )
