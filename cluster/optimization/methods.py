"""Methods by name: those that ship, those of installed packages, and a user's own.

One core knows the methods that ship (`svaedc.bo.methods`), the other how parts are found by name
(`workers.plug_ins`). Neither imports the other, so the two meet here. What needs torch is imported
when it is used: names are light.
"""

from typing import TYPE_CHECKING, Final

from cluster.inputs import search_working_directory
from svaedc.bo import method_names
from svaedc.bo.method_names import names, ships
from workers import plug_ins
from workers.plug_ins import Kind, Part
from workers.user_modules import call

if TYPE_CHECKING:
    from svaedc.bo.candidates import Problem
    from svaedc.bo.strategies import Method

__all__ = ["KIND", "build", "code", "names", "needs_candidates", "needs_model", "require"]

KIND: Final = Kind("method", "svaedc.methods", names())


def needs_model(name: str) -> bool:
    """Whether a method needs the latents of a trained model.

    Raises:
        LookupError: There is no such method; the message names the nearest.
    """
    return method_names.needs_model(name) if ships(name) else _own_needs_model(name)


def needs_candidates(name: str) -> bool:
    """Whether a method needs candidates that were simulated; a user's says so as `needs_candidates = True`.

    Raises:
        LookupError: There is no such method; the message names the nearest.
    """
    if ships(name):
        return method_names.needs_candidates(name)
    return bool(getattr(_own(name).value, "needs_candidates", False))


def build(name: str, problem: "Problem") -> "Method":
    """Build a method for one run.

    Args:
        name: Of one that ships, perhaps with a search and an acquisition behind it; of the entry point of an
            installed package, in the group `svaedc.methods`; or `module:name`.
        problem: What the methods of a run share.

    Returns:
        The method.

    Raises:
        LookupError: There is no such method, or it cannot be made.
        ValueError: The problem lacks the latents or the pool that the method needs.
    """
    from svaedc.bo import methods
    from svaedc.bo.own_method import OwnMethod
    from svaedc.bo.strategies import Method

    if ships(name):
        return methods.build(name, problem)
    part = _own(name)
    method = call(name, part.value, problem)
    if not isinstance(method, Method):
        raise LookupError(
            f"{name} must give an object with suggest(history, rng), got {type(method).__name__}; "
            "see svaedc.bo.own_method"
        )
    return OwnMethod(name, method, problem.dimensions)


def require(name: str, problem: "Problem", trials: int) -> None:
    """Refuse a method that could not suggest so many controllers.

    Args:
        name: As for `build`.
        problem: What the methods of a run share.
        trials: Controllers it has to suggest.

    Raises:
        LookupError: There is no such method, or it cannot be made.
        ValueError: The problem lacks what the method needs, or its pool would run dry.
    """
    from svaedc.bo import methods

    if ships(name):
        methods.require(name, problem, trials)
    else:
        build(name, problem)


def code(name: str) -> str:
    """SHA-256 of the file of a user's method; "" for one that ships."""
    return "" if ships(name) else _own(name).code


def _own_needs_model(name: str) -> bool:
    return bool(getattr(_own(name).value, "needs_model", False))


def _own(name: str) -> Part:
    search_working_directory()
    part = plug_ins.find(name, KIND)
    if not callable(part.value):
        raise LookupError(
            f"{name} must be a class or function that makes a method of a problem, got "
            f"{type(part.value).__name__}; see svaedc.bo.own_method"
        )
    return part
