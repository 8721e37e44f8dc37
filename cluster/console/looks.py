"""Addresses at which a campaign is looked at; nothing is written."""

import asyncio
import json
import math
import tempfile
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any, Final

from fastapi import APIRouter, Depends, HTTPException, Request
from fastapi.responses import FileResponse, HTMLResponse, Response, StreamingResponse

from cluster.console.asking import Console, Ours, Visitor, visitor
from cluster.console.desk import CLIPS, Desk, View
from cluster.console.sessions import BrowserSession
from cluster.errors import UserError
from cluster.hardware.record.export import export
from cluster.hardware.record.page import progress
from cluster.hardware.states import State

LOOK_SECONDS: Final = 0.2
TELL_SECONDS: Final = 2.0
KINDS: Final = {"jsonl": "application/jsonl", "csv": "text/csv", "parquet": "application/vnd.apache.parquet"}

router = APIRouter(dependencies=[Depends(visitor)])


@router.get("/", response_class=HTMLResponse)
def now(console: Ours, session: Visitor) -> str:
    """What the campaign needs now."""
    return console.pages.now(session, console.desk.look())


@router.get("/trials", response_class=HTMLResponse)
def history(console: Ours, session: Visitor) -> str:
    """Every trial."""
    return console.pages.history(session, console.desk.look())


@router.get("/trials/{number}", response_class=HTMLResponse)
def trial(console: Ours, session: Visitor, number: int) -> str:
    """One trial."""
    view = console.desk.look()
    if not 0 <= number < len(view.rows):
        raise HTTPException(404, f"there is no trial {number}: there are {len(view.rows)}, from 0")
    return console.pages.trial(session, view, number)


@router.get("/state")
def state(console: Ours) -> dict[str, Any]:
    """What `svaedc hardware status --json` prints, with the motion under way."""
    view = console.desk.look()
    return {**view.pulse(), **view.status.as_json()}


@router.get("/live")
async def live(console: Ours, request: Request, session: Visitor) -> Response:
    """Server-sent events: one whenever something changed."""
    return StreamingResponse(_pulses(console, request, session), media_type="text/event-stream")


@router.get("/trials/{number}/clip")
def clip(console: Ours, number: int) -> Response:
    """The drawing of a trial's first simulation."""
    path = console.desk.clip(number)
    if path is None:
        raise HTTPException(404, "nothing was drawn of this trial")
    return FileResponse(path, media_type=CLIPS[path.suffix])


@router.get("/figure.svg")
def figure(console: Ours) -> Response:
    """How the campaign goes."""
    measured = [row for row in console.desk.look().rows if row["state"] == State.MEASURED]
    return Response(progress(measured), media_type="image/svg+xml")


@router.get("/attachments/{sha256}")
def attachment(console: Ours, sha256: str) -> Response:
    """A file of a trial, to be kept and not to be shown: it may hold anything."""
    found = console.desk.attachment(sha256)
    if found is None:
        raise HTTPException(404, "there is no such file")
    path, known = found
    return FileResponse(path, media_type="application/octet-stream", filename=known.name)


@router.get("/export/{form}")
def export_as(console: Ours, form: str) -> Response:
    """The campaign for other programs."""
    if form not in KINDS:
        raise HTTPException(404, f"there are {', '.join(KINDS)}")
    with tempfile.TemporaryDirectory(prefix="svaedc-") as name:
        path = Path(name) / f"campaign.{form}"
        export(console.desk.folder, form, path)
        content = path.read_bytes()
    headers = {"content-disposition": f'attachment; filename="campaign.{form}"'}
    return Response(content, media_type=KINDS[form], headers=headers)


async def _pulses(console: Console, request: Request, session: BrowserSession) -> AsyncIterator[str]:
    """An event whenever something changed, and every few seconds, so that silence means something."""
    pulses, told, sent = Pulses(console.desk), "", -math.inf
    clock = asyncio.get_running_loop().time
    while not (console.closing.is_set() or await request.is_disconnected()):
        if not await asyncio.to_thread(console.tokens.knows, session.person):
            return
        pulse = await asyncio.to_thread(pulses.next)
        if pulse != told or clock() - sent > TELL_SECONDS:
            told, sent = pulse, clock()
            yield pulse
        await asyncio.sleep(LOOK_SECONDS)


class Pulses:
    """What one open page is told; the journal is read again only where it has changed.

    Args:
        desk: of the campaign.
    """

    def __init__(self, desk: Desk) -> None:
        self._desk = desk
        self._signature: tuple[int, ...] = ()
        self._view: View | None = None

    def next(self) -> str:
        """One event, as the stream has it."""
        try:
            signature = self._desk.signature()
            unchanged = self._view if signature == self._signature else None
            self._view = self._desk.look_again(unchanged) if unchanged else self._desk.look()
            self._signature = signature
        except UserError as error:
            return f"event: trouble\ndata: {json.dumps(str(error))}\n\n"
        return f"data: {json.dumps(self._view.pulse())}\n\n"
