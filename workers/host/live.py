"""What others may see of a motion while it is under way: a small file, written anew a few times a second."""

import json
import os
import threading
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from workers.host.motion import Pulse

PERIOD_SECONDS = 0.2


def publish(path: Path, pulse: Pulse, facts: Callable[[], Mapping[str, Any]]) -> None:
    """Write what is known of every motion from now on, in a thread of its own, for ever.

    It is for eyes alone: nothing waits for it, and a disk that takes no more takes nothing away.

    Args:
        path: of the file; what it says of the last motion stays.
        pulse: of the motion.
        facts: plain values that are told beside the pulse's.
    """

    def tell() -> None:
        was_moving = False
        while True:
            if pulse.moving or was_moving:
                with suppress(OSError, ValueError):
                    _write(path, {**facts(), **_seen(pulse)})
            was_moving = pulse.moving
            time.sleep(PERIOD_SECONDS)

    threading.Thread(target=tell, name="live", daemon=True).start()


def read(path: Path) -> dict[str, Any]:
    """What the file says; nothing where there is none.

    Args:
        path: of the file.

    Returns:
        `trial`, `steps` (of its plan), `names` and `units` of the channels, `moving`, `sent` (commands),
        `late`, `command` (the last one) and `seconds` since the first.
    """
    try:
        found = json.loads(path.read_bytes())
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def _seen(pulse: Pulse) -> "dict[str, Any]":
    sent = pulse.sent
    count = len(sent)
    first, last = (sent[0], sent[count - 1]) if count else ((0.0,), (0.0,))
    return {
        "moving": pulse.moving,
        "sent": count,
        "late": pulse.late,
        "seconds": last[0] - first[0],
        "command": list(last[1:]),
    }


def _write(path: Path, content: Mapping[str, Any]) -> None:
    """Whole or not at all, and not to last: a disk is not waited for."""
    unfinished = path.with_name(f"{path.name}.{os.getpid()}.unfinished")
    unfinished.write_text(json.dumps(content, allow_nan=False), encoding="utf-8")
    unfinished.replace(path)
