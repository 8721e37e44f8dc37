"""`svaedc check`: a minute that tells what is wrong with a robot before many episodes are collected."""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from ray import cloudpickle

from cluster.errors import UserError
from cluster.progress import say
from cluster.rendering.episodes import first_physics
from cluster.rendering.render import Drawing, render
from svaedc.analysis.words import quantity
from workers.conformance.remark import Remark, Severity
from workers.conformance.sample import Sample, sample
from workers.conformance.suite import CHECKS, Check, find
from workers.setups import Setup

_WIDTH, _HEIGHT, _STILLS, _FPS = 360, 270, 6, 10


def check(setup: Setup, seed: int, timeout: float, picture: Path | None) -> None:
    """Check a robot, and say what is found as it is found.

    Args:
        setup: the robot.
        seed: of the controllers and physics that are tried.
        timeout: longest duration of an episode, in s.
        picture: file of a picture of an episode, .png or .gif; None for none.

    Raises:
        UserError: there are mistakes.
    """
    say(
        f"{setup.name}: {setup.dimensions} parameters, {len(setup.observation)} channels, {setup.horizon} "
        f"steps of {1e3 * setup.control_step:g} ms"
    )
    found = Counter(finding.severity for finding in _findings(setup, seed, timeout))
    if picture is not None:
        _draw(setup, seed, picture)
    mistakes, doubts = found[Severity.MISTAKE], found[Severity.DOUBT]
    counts = f"{quantity(mistakes, 'mistake')}, {quantity(doubts, 'doubt')}"
    if mistakes:
        raise UserError(f"{setup.name} has {counts}; mend the mistakes before you collect")
    say(f"{setup.name} can be collected: {counts}")


def _findings(setup: Setup, seed: int, timeout: float) -> Iterator[Remark]:
    with sample(setup, seed, timeout) as looked_at:
        say(f"{len(looked_at.episodes)} episodes of seed {seed}, each {1e3 * looked_at.seconds:.3g} ms")
        for each in (*CHECKS, _PICKLING):
            findings = find(each, looked_at)
            for finding in findings:
                say(f"  {finding.severity:8} {finding.check:12} {finding.text}")
            if not findings:
                say(f"  {'ok':8} {each.name:12} {each.passed}")
            yield from findings


def _check_pickling(looked_at: Sample) -> Iterator[Remark]:
    """Ray can send the setup to another process."""
    try:
        cloudpickle.dumps(looked_at.setup)
    except Exception as error:  # noqa: BLE001 - whatever a user's object raises
        yield Remark(
            "pickling",
            Severity.DOUBT,
            f"Ray cannot send the setup to another process: {type(error).__name__}: {error}; keep open "
            "files, locks and simulators out of it, and make them in the environment",
        )


_PICKLING = Check("pickling", "Ray can send it to other processes", _check_pickling)


def _draw(setup: Setup, seed: int, picture: Path) -> None:
    """The controller of episode 0; a robot without a picture is no mistake."""
    try:
        render(
            setup,
            f"random:{seed}",
            first_physics(setup, seed),
            Drawing(picture, _WIDTH, _HEIGHT, None, _FPS, _STILLS),
            None,
        )
    except UserError as error:
        say(f"  {'no':8} {'picture':12} {error}")
