"""Addresses at which an operator decides about a trial."""

import asyncio
import re
import tempfile
from pathlib import Path
from typing import Final

from fastapi import APIRouter, Depends, Request
from fastapi.responses import JSONResponse, RedirectResponse, Response
from starlette.datastructures import UploadFile

from cluster.console.asking import (
    Decider,
    Form,
    Ours,
    Visitor,
    number_in,
    operator_in,
    version_in,
    visitor,
    wants_json,
)
from cluster.errors import UsageError
from cluster.hardware import operator

LONGEST_NOTE: Final = 2_000
_LONGEST_NAME: Final = 200  # bytes

router = APIRouter(prefix="/trials/{number}", dependencies=[Depends(visitor)])


@router.post("/approve")
def approve(console: Ours, request: Request, number: int, who: Decider, form: Form) -> Response:
    """Let a checked trial onto the robot."""
    minutes = number_in(form, "minutes") or operator.VALID_MINUTES
    operator.approve(console.desk.folder, number, who.name, minutes, version_in(form))
    return _answer(request, "/")


@router.post("/withdraw")
def withdraw(console: Ours, request: Request, number: int, who: Decider, form: Form) -> Response:
    """Take an approval back."""
    operator.withdraw(console.desk.folder, number, who.name, version_in(form))
    return _answer(request, "/")


@router.post("/reject")
def reject(console: Ours, request: Request, number: int, who: Decider, form: Form) -> Response:
    """Keep a trial off the robot."""
    operator.reject(console.desk.folder, number, who.name, _note(form.get("note", "")), version_in(form))
    return _answer(request, "/")


@router.post("/resolve")
def resolve(console: Ours, request: Request, number: int, who: Decider, form: Form) -> Response:
    """Say what became of an unknown trial."""
    if form.get("at_rest") != "yes":
        raise UsageError("say that you have seen the robot stand still and reset: at_rest=yes")
    f, y, again = (number_in(form, name) for name in ("f", "y", "confirm"))
    note, seen = _note(form.get("note", "")), version_in(form)
    operator.resolve(console.desk.folder, number, form.get("outcome", ""), who.name, note, f, y, again, seen)
    return _answer(request, "/")


@router.post("/amend")
def amend(console: Ours, request: Request, number: int, who: Decider, form: Form) -> Response:
    """Correct what a trial measured."""
    f, y, again = (number_in(form, name) for name in ("f", "y", "confirm"))
    if f is None or y is None:
        raise UsageError("an amended trial needs its objective f and its badness y")
    note, seen = _note(form.get("note", "")), version_in(form)
    operator.amend(console.desk.folder, number, who.name, note, f, y, again, seen)
    return _answer(request, f"/trials/{number}")


@router.post("/attach")
async def attach(console: Ours, request: Request, session: Visitor, number: int) -> Response:
    """Keep a file with a trial."""
    async with request.form(max_files=1, max_fields=5, max_part_size=64 * 1024) as form:
        who = operator_in(session, str(form.get("key", "")))
        file, note = form.get("file"), _note(str(form.get("note", "")))
        if file is None or isinstance(file, str):
            raise UsageError("choose a file to attach")
        await asyncio.to_thread(_keep, console.desk.folder, number, file, who.name, note)
    return _answer(request, f"/trials/{number}")


def harmless_name(name: str) -> str:
    """The name of a file, whatever a browser says: no folders, no control characters, not too long."""
    last = re.split(r"[/\\]", name)[-1]
    kept = "".join(letter if letter.isprintable() else "_" for letter in last).strip(" .")
    while len(kept.encode("utf-8", "replace")) > _LONGEST_NAME:
        kept = kept[1:]
    return kept or "attachment"


def _keep(folder: Path, number: int, file: UploadFile, who: str, note: str) -> None:
    with tempfile.TemporaryDirectory(prefix="svaedc-") as name:
        path = Path(name) / harmless_name(file.filename or "")
        with path.open("wb") as copy:
            while block := file.file.read(1 << 20):
                copy.write(block)
        operator.attach(folder, number, path, who, note)


def _note(text: str) -> str:
    if len(text) > LONGEST_NOTE:
        raise UsageError(f"a note has at most {LONGEST_NOTE} characters, got {len(text)}: attach a file")
    return text


def _answer(request: Request, page: str) -> Response:
    return JSONResponse({"done": True}) if wants_json(request) else RedirectResponse(page, 303)
