"""`dataset.json`: how a dataset begins, once, even if two writers begin it at the same moment."""

import hashlib
import json

from workers.dataset.identity import Identity
from workers.dataset.storage.atomic import link, synchronise, temporary_file
from workers.dataset.storage.location import Location
from workers.dataset.storage.s3 import ObjectPath
from workers.dataset.storage.temporary import WRITING, is_dead, writer

MANIFEST = "dataset.json"


def manifest_text(identity: Identity) -> str:
    """The content of `dataset.json`."""
    return json.dumps(json.loads(identity.to_json()), indent=2) + "\n"


def ensure_manifest(folder: Location, text: str) -> bytes:
    """Write the manifest unless there is one.

    Args:
        folder: of the dataset; it must exist.
        text: of the manifest, as from `manifest_text`.

    Returns:
        The bytes of the one that counts, of two writers the first's.
    """
    manifest = folder / MANIFEST
    if manifest.exists():
        return manifest.read_bytes()
    if isinstance(folder, ObjectPath):
        return _claim(folder, text)
    with temporary_file(folder, MANIFEST) as temporary:
        temporary.write_text(text, encoding="utf-8")
        synchronise(temporary)
        link(temporary, manifest)
    return manifest.read_bytes()


def _claim(folder: ObjectPath, text: str) -> bytes:
    """The same where no write can be made to depend on there being nothing.

    A writer first lays a claim in a name of its own, and goes on only if nobody else's claim is of another
    text, and there still is no manifest. So of two that differ never do both go on: the later claim sees the
    earlier one, or its manifest. Two at the very same moment may both give way.
    """
    manifest = folder / MANIFEST
    claim = folder / WRITING / f"{MANIFEST}.{hashlib.sha256(text.encode()).hexdigest()[:12]}.{writer()}"
    claim.write_text(text, encoding="utf-8")
    try:
        rival = _rival(folder, text)
        if not rival and not manifest.exists():
            manifest.write_text(text, encoding="utf-8")
        return rival or manifest.read_bytes()
    finally:
        claim.unlink(missing_ok=True)


def _rival(folder: ObjectPath, text: str) -> bytes:
    """The manifest of a living writer that claims the folder for something else; empty without one."""
    for path in (folder / WRITING).glob(f"{MANIFEST}.*"):
        if is_dead(path.name):
            continue
        try:
            claimed = path.read_bytes()
        except FileNotFoundError:
            continue  # withdrawn meanwhile; if it went on, the manifest is there
        if claimed != text.encode():
            return claimed
    return b""
