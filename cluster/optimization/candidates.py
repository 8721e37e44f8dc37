"""`candidates.parquet`: what simulation showed of every candidate, in every world, and what that is from."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import torch
from jaxtyping import Float32, Float64

from cluster.errors import UserError
from cluster.files import replacing
from svaedc.bo.features import Latents
from svaedc.bo.simulated.outcomes import Lookup, SimulatedLatents, SimulatedOutcomes
from workers.dataset.shards import sha256
from workers.dataset.storage.location import arrow_name
from workers.plug_ins import file_name
from workers.rollout import VERSION
from workers.setups import Setup
from workers.setups.registry import KIND

TABLE: Final = "candidates.parquet"
_ORIGIN: Final = b"svaedc.candidates"


@dataclass(frozen=True, eq=False)
class CandidateTable:
    """Candidates and how they fared.

    Attributes:
        x: controllers.
        f: objectives, [candidate, world].
        y: badness.
        bad: share of steps in which each bad condition held.
        tau: latent paths of the episodes, flattened, by the SHA-256 of the model that encoded them.
        origin: plain values: setups, their parameters, gap, count, chosen, seed, fingerprints, sizes of
            latent paths by model, names of the bad conditions, and setup and physics of each world.
    """

    x: Float32[np.ndarray, "n d"]
    f: Float64[np.ndarray, "n e"]
    y: Float64[np.ndarray, "n e"]
    bad: Float64[np.ndarray, "n e conditions"]
    tau: Mapping[str, Float64[np.ndarray, "n e k"]]
    origin: Mapping[str, Any]

    @property
    def drawn(self) -> Float32[np.ndarray, "m d"]:
        """Those that were not chosen, but drawn from the whole unit cube."""
        return self.x[self.origin["chosen"] :]

    def outcomes(self) -> SimulatedOutcomes:
        """The outcomes, as methods take them."""
        return SimulatedOutcomes(torch.from_numpy(self.f), torch.from_numpy(self.y), Lookup(self.x))

    def latents(self, pool: Float32[np.ndarray, "n d"], model: str) -> Latents | None:
        """Latent paths and badness of some of the candidates, as methods take them.

        Args:
            pool: candidates, [n, D].
            model: SHA-256 of the one that encoded the episodes.

        Returns:
            Means of q(tau|xi, y) and of y over the worlds; None where that model encoded nothing.
        """
        if model not in self.tau:
            return None
        tau, y = torch.from_numpy(self.tau[model].mean(axis=1)), torch.from_numpy(self.y.mean(axis=1))
        return Latents.of(torch.from_numpy(pool), SimulatedLatents(tau, y, Lookup(self.x)))


def write(path: Path, table: CandidateTable) -> None:
    """One row per candidate; the file is whole, or as it was before.

    Args:
        path: of the file.
        table: what it shall hold.

    Raises:
        OSError: the disk takes no more.
    """
    columns = {
        "x": _lists(table.x),
        "f": _lists(table.f),
        "y": _lists(table.y),
        "bad": _lists(table.bad),
        "f_mean": table.f.mean(axis=1),
        "f_spread": table.f.std(axis=1),
        "y_mean": table.y.mean(axis=1),
        "y_spread": table.y.std(axis=1),
    }
    for model, tau in table.tau.items():
        columns |= {
            _latents(model): _lists(tau),
            f"{_latents(model)}_mean": _lists(tau.mean(axis=1)),
            f"{_latents(model)}_spread": _lists(tau.std(axis=1)),
        }
    content = pa.table({"candidate": np.arange(len(table.x)), **columns})
    content = content.replace_schema_metadata({_ORIGIN: json.dumps(dict(table.origin), sort_keys=True)})
    with replacing(path) as unfinished:
        pq.write_table(content, arrow_name(unfinished), compression="zstd", write_page_checksum=True)


def read(path: Path) -> CandidateTable:
    """The candidates of a file.

    Raises:
        UserError: there is none, it is damaged, or no table of candidates.
    """
    try:
        content = pq.read_table(arrow_name(path), page_checksum_verification=True)
        origin = json.loads((content.schema.metadata or {})[_ORIGIN])
        count, worlds, conditions = content.num_rows, len(origin["worlds"]), len(origin["conditions"])
        return CandidateTable(
            x=_dense(content["x"], (count, -1)),
            f=_dense(content["f"], (count, worlds)),
            y=_dense(content["y"], (count, worlds)),
            bad=_dense(content["bad"], (count, worlds, conditions)),
            tau={
                model: _dense(content[_latents(model)], (count, worlds, int(size)))
                for model, size in origin["models"].items()
            },
            origin=origin,
        )
    except FileNotFoundError as error:
        raise UserError(
            f"there are no candidates in {path.parent}: `svaedc candidates --out {path.parent}` makes them"
        ) from error
    except (pa.ArrowException, OSError, KeyError, ValueError, TypeError) as error:
        raise UserError(
            f"{path} is damaged, or no table of candidates ({error}); remove it, and `svaedc candidates` "
            "with the options of before writes it anew from the episodes beside it"
        ) from error


def require_usable(path: Path, setup: Setup, models: Sequence[Path], initial: int) -> None:
    """Refuse candidates that a comparison or campaign of this robot cannot choose among.

    Args:
        path: of their table.
        setup: whose controllers are tried.
        models: checkpoints that encoded the episodes, unless none did.
        initial: random trials of a run, which are candidates that were drawn.

    Raises:
        UserError: they cannot be read, are too few, are of other controllers or of another version of their
            setups, or their latent paths are of another model.
    """
    table = read(path)
    if len(table.drawn) < initial:
        raise UserError(
            f"the candidates of {path.parent} must hold {initial} that were drawn, for the random trials of "
            f"a run, got {len(table.drawn)}: simulate more with --count"
        )
    if table.x.shape[1] != setup.dimensions:
        raise UserError(
            f"the candidates of {path.parent} have {table.x.shape[1]} parameters, {setup.name} has "
            f"{setup.dimensions}: simulate some of this robot"
        )
    if list(map(list, table.origin["parameters"])) != parameters_of(setup):
        raise UserError(
            f"the candidates of {path.parent} are controllers of {', '.join(table.origin['setups'])}, whose "
            f"parameters are not those of {setup.name}: simulate some of this robot"
        )
    if table.origin["rollout_version"] != VERSION:
        raise UserError(
            f"the candidates of {path.parent} were simulated by version {table.origin['rollout_version']} of "
            f"the simulation, this is {VERSION}: simulate them again"
        )
    codes = dict(zip(table.origin["setups"], table.origin["setup_digests"], strict=True))
    if codes.get(setup.name, setup.code) != setup.code:
        raise UserError(
            f"{file_name(setup.name, KIND)} has changed since the candidates of {path.parent} were "
            "simulated: put it back as it was, or simulate them again in another folder"
        )
    for model in models:
        if table.tau and sha256(model) not in table.tau:
            raise UserError(
                f"the latent paths of {path.parent} are of another model than {model}: simulate them again "
                "with that one, in the same folder, which keeps the episodes"
            )


def parameters_of(setup: Setup) -> list[list[Any]]:
    """Name and bounds of the controller's parameters, as values of JSON."""
    return [[each.name, float(each.low), float(each.high)] for each in setup.controller.parameters]


@cache
def shared_candidates(path: Path) -> CandidateTable:
    """The same candidates, read once in a process, however many runs choose among them."""
    return read(path)


def origin_of(path: Path) -> Mapping[str, Any]:
    """What a table is from; nothing where there is no table that can be read."""
    try:
        return dict(json.loads((pq.read_schema(arrow_name(path)).metadata or {})[_ORIGIN]))
    except (pa.ArrowException, OSError, KeyError, ValueError):
        return {}


def _latents(model: str) -> str:
    """Column of the latent paths by the model of that SHA-256."""
    return f"tau_{model[:12]}"


def _lists(values: np.ndarray) -> pa.Array:
    flat = np.ascontiguousarray(values.reshape(len(values), -1))
    return pa.FixedSizeListArray.from_arrays(pa.array(flat.reshape(-1)), flat.shape[1])


def _dense(column: pa.ChunkedArray, shape: tuple[int, ...]) -> np.ndarray:
    values = pa.chunked_array([chunk.flatten() for chunk in column.chunks], column.type.value_type)
    return values.to_numpy().reshape(shape).copy()
