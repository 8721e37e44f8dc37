"""Every trial of a campaign as one row: what was expected of it, who let it run, what it measured."""

import csv
import io
import json
from collections.abc import Mapping, Sequence
from typing import Any

import pyarrow

from cluster.hardware.events import CampaignTrial, Event
from cluster.hardware.journal import Journal
from cluster.hardware.states import TERMINAL, State

INTEGERS = ("trial", "amended")
TEXTS = ("kind", "state", "approved_by", "decided_by", "note", "proposed_at", "ended_at", "stop", "sha256")
COLUMNS = (
    "trial", "kind", "state", "f", "y",
    "predicted_y", "simulated_y", "simulated_y_low", "simulated_y_high", "simulated_f", "clearance",
    "approved_by", "decided_by", "note", "proposed_at", "ended_at", "seconds", "stop", "amended", "sha256",
)  # fmt: skip
"""Columns of a row, before those of the controller, x_0, x_1, ..."""


def rows(journal: Journal) -> list[dict[str, Any]]:
    """Gather a campaign's trials.

    Args:
        journal: of the campaign.

    Returns:
        A row for every trial, by number: plain values under `COLUMNS`, None where there is none; and `x`, the
        parameters in [0, 1].
    """
    events = journal.events()
    return [
        _row(trial, [event for event in events if event.trial == trial.number]) for trial in journal.trials()
    ]


def as_csv(found: Sequence[Mapping[str, Any]]) -> str:
    """Write rows as comma-separated values with a header; numbers are read back to the last bit.

    Args:
        found: the rows.

    Returns:
        The text.
    """
    flat = list(map(_flat, found))
    text = io.StringIO()
    writer = csv.DictWriter(text, _names(found), lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return text.getvalue()


def as_table(found: Sequence[Mapping[str, Any]]) -> pyarrow.Table:
    """Rows as a table for Parquet: numbers are float64, counts int64, all else text.

    Args:
        found: the rows.

    Returns:
        The table.
    """
    flat, names = list(map(_flat, found)), _names(found)
    fields = [pyarrow.field(name, _type(name)) for name in names]
    return pyarrow.Table.from_pylist(flat, schema=pyarrow.schema(fields))


def _row(trial: CampaignTrial, events: list[Event]) -> dict[str, Any]:
    checked = _last(events, lambda body: "plan" in body)
    simulated = checked.get("simulated") or {}
    ended = [event for event in events if event.new in TERMINAL]
    first = json.loads(ended[0].body) if ended else {}
    last = json.loads(events[-1].body)
    y, f = simulated.get("y") or {}, simulated.get("f") or {}
    return {
        "trial": trial.number,
        "kind": trial.kind,
        "state": str(trial.state),
        "f": trial.f,
        "y": trial.y,
        "predicted_y": checked.get("predicted_y"),
        "simulated_y": y.get("mean"),
        "simulated_y_low": y.get("low"),
        "simulated_y_high": y.get("high"),
        "simulated_f": f.get("mean"),
        "clearance": simulated.get("clearance"),
        "approved_by": _who(events, State.APPROVED),
        "decided_by": ended[-1].who if ended else None,
        "note": last.get("note") or last.get("reason") or last.get("fault") or last.get("cause"),
        "proposed_at": events[0].at,
        "ended_at": ended[0].at if ended else None,
        "seconds": first.get("seconds"),
        "stop": first.get("stop"),
        "amended": len(ended) - 1 if ended else 0,
        "sha256": trial.sha256,
        "x": trial.x.tolist(),
    }


def _last(events: list[Event], matches: Any) -> dict[str, Any]:
    bodies = (json.loads(event.body) for event in reversed(events))
    return next((body for body in bodies if matches(body)), {})


def _who(events: list[Event], state: State) -> str | None:
    return next((event.who for event in reversed(events) if event.new is state), None)


def _names(found: Sequence[Mapping[str, Any]]) -> list[str]:
    return [*COLUMNS, *(f"x_{number}" for number in range(len(found[0]["x"]) if found else 0))]


def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
    parameters = {f"x_{number}": value for number, value in enumerate(row["x"])}
    return {**{name: row[name] for name in COLUMNS}, **parameters}


def _type(name: str) -> pyarrow.DataType:
    if name in INTEGERS:
        return pyarrow.int64()
    return pyarrow.string() if name in TEXTS else pyarrow.float64()
