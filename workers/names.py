"""Names that are known, and what is said to those who ask for another."""

import difflib
from collections.abc import Collection, Iterable


def require_known(name: str, kind: str, names: Collection[str]) -> str:
    """Refuse a name that is not one of the names.

    Args:
        name: what was asked for.
        kind: of thing that it names, for the error.
        names: that are known.

    Returns:
        The name itself.

    Raises:
        LookupError: it is none of them; the message suggests the nearest.
    """
    if name in names:
        return name
    hint = nearest(name, names)
    raise LookupError(f"unknown {kind} {name!r}; {f'{hint} ' if hint else ''}known: {', '.join(names)}")


def nearest(name: str, names: Iterable[str]) -> str:
    """Suggest what was meant.

    Args:
        name: what was asked for.
        names: that are known.

    Returns:
        `did you mean 'franka'?`; "" if nothing is known.
    """
    close = difflib.get_close_matches(name, list(names), n=1, cutoff=0.0)
    return f"did you mean {close[0]!r}?" if close else ""
