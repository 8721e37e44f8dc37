"""Shards that kept failing, put aside with their errors."""

import json
from collections.abc import Sequence
from pathlib import Path

from workers.dataset.shards import Shard

FOLDER = "quarantine"


def put_aside(dataset: Path, shard: Shard, errors: Sequence[str]) -> Path:
    """Keep the errors of a shard that was given up; the next `collect` tries it afresh."""
    folder = dataset / FOLDER
    folder.mkdir(exist_ok=True)
    path = folder / f"{shard.name}.json"
    path.write_text(
        json.dumps({"start": shard.start, "stop": shard.stop, "errors": list(errors)}, indent=2) + "\n"
    )
    return path


def release(dataset: Path, shard: Shard) -> None:
    """Forget the errors of a shard that has succeeded since."""
    (dataset / FOLDER / f"{shard.name}.json").unlink(missing_ok=True)


def quarantined(dataset: Path) -> list[str]:
    """Names of the shards put aside."""
    folder = dataset / FOLDER
    return sorted(path.stem for path in folder.glob("*.json")) if folder.exists() else []
