"""The lines between a host and whoever drives it: JSON, one message a line, on standard input and output.

A host first says `hello`: protocol, pid, rest, period, channels; or `absent`, with a reason, and ends.

| it is told | fields | it answers |
|---|---|---|
| `plan` | trial, x | `planned`: seconds, steps, channels with their extremes, objection |
| `run` | trial, x, seconds | `started`, once that is in the ledger; then one of the ends below |
| `beat` | | nothing: it is a sign of life, due every `BEAT_SECONDS` while a trial runs |
| `close` | | nothing: it lets go of the robot and ends; the end of its input means the same, at once |

The ends of a trial: `ended`, with its measurement; and, each with a reason, `stopped` (a stop, a deadline,
silence or a limit: the robot is at rest), `fault` (the robot broke off and stands still), `broke` (the driver
failed: nobody knows what the robot did) and `refused` (nothing moved). x is the controller as little-endian
float64 in hexadecimal. What cannot be read is refused.
"""

import json
import struct
from collections.abc import Mapping, Sequence
from typing import Any

VERSION = 1
BEAT_SECONDS = 0.2


def line_of(message: Mapping[str, Any]) -> bytes:
    """A message as a line.

    Raises:
        ValueError: it holds NaN or infinity.
    """
    return json.dumps(message, allow_nan=False).encode() + b"\n"


def message_of(line: bytes) -> "dict[str, Any]":
    """The message in a line.

    Raises:
        ValueError: there is none.
    """
    try:
        found = json.loads(line)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"no message: {line[:80]!r} ({error})") from None
    if not isinstance(found, dict):
        raise ValueError(f"a message must be a JSON object, got {line[:80]!r}")
    return found


def encode(x: Sequence[float]) -> str:
    """A controller in hexadecimal."""
    return struct.pack(f"<{len(x)}d", *x).hex()


def decode(text: Any) -> "tuple[float, ...]":
    """A controller from hexadecimal.

    Raises:
        ValueError: it is none, or a parameter does not lie in [0, 1].
    """
    if not isinstance(text, str) or len(text) % 16:
        raise ValueError(f"x must be float64 in hexadecimal, got {text!r:.80}")
    content = bytes.fromhex(text)
    x = struct.unpack(f"<{len(content) // 8}d", content)
    odd = [value for value in x if not 0.0 <= value <= 1.0]
    if odd:
        raise ValueError(f"every parameter of x must lie in [0, 1], got {odd[0]}")
    return x
