"""A setup with G_bad of a user's own, named as `module:function`."""

import inspect
from dataclasses import replace
from typing import Any, Final

from workers import plug_ins
from workers.plug_ins import Kind
from workers.setups.registry import file_digest
from workers.setups.setup import Setup
from workers.tasks.own_bad import OwnBad, marked_conditions

KIND: Final = Kind("G_bad", "svaedc.bad", ())


def with_bad(setup: Setup, name: str) -> Setup:
    """Replace a setup's G_bad by a user's own.

    Args:
        setup: whose G_bad it is.
        name: of the function, as `module:function`; "" for none.

    Returns:
        The setup with that G_bad; as it was for the name "".

    Raises:
        LookupError: there is no such module, or no such function in it.
    """
    if not name:
        return setup
    function = _function(name)
    marked = marked_conditions(function)
    return replace(
        setup,
        task=OwnBad(
            task=setup.task,
            function=function,
            bad_name=name,
            bad_digest=file_digest(function),
            conditions=marked or (function.__name__,),
            graded=not marked,
        ),
    )


def _function(name: str) -> Any:
    if ":" not in name:
        raise LookupError(f"G_bad must be named as module:function, got {name!r}")
    function = plug_ins.find(name, KIND).value
    if not inspect.isfunction(function):
        raise LookupError(f"{name} must be a function of what an episode showed, got {function!r}")
    return function
