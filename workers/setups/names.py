"""The names of the setups that ship; importing them costs no time."""

import difflib
from collections.abc import Mapping

SETUPS = {
    "franka": "workers.setups.franka:franka",
    "daisy-27d": "workers.setups.daisy:daisy_27d",
    "daisy-11d": "workers.setups.daisy:daisy_11d",
    "daisy-11d-rehearsal": "workers.setups.daisy:daisy_11d_rehearsal",
    "quadratic-30d": "workers.setups.quadratic:quadratic_30d",
    "quadratic-30d-intrinsic-3": "workers.setups.quadratic:quadratic_30d_intrinsic_3",
    "franka-rehearsal": "workers.setups.franka:franka_rehearsal",
    "yumi": "workers.setups.yumi:yumi",
    "yumi-rehearsal": "workers.setups.yumi:yumi_rehearsal",
}
"""These setups ship; each name leads to the module and the function that makes it. A new robot is one module,
and one line here for each of its variants. A module of the user's own needs no line, and offers `setup()`."""


def require_known(name: str, kind: str, names: Mapping[str, object]) -> str:
    """Refuse a name that is not one of the names.

    Args:
        name: what was asked for.
        kind: of thing that it names, for the error.
        names: that are known, as keys.

    Returns:
        The name itself.

    Raises:
        LookupError: it is none of them; the message suggests the nearest.
    """
    if name in names:
        return name
    nearest = difflib.get_close_matches(name, names, n=1, cutoff=0.0)
    hint = f"did you mean {nearest[0]!r}? " if nearest else ""
    raise LookupError(f"unknown {kind} {name!r}; {hint}known: {', '.join(names)}")
