"""The console's pages: HTML that was made on the server, and needs no script."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined

from cluster.console.desk import Desk, View
from cluster.console.sessions import BrowserSession
from cluster.hardware.operator import VALID_MINUTES
from cluster.hardware.record.page import facts_told, number, when
from cluster.hardware.record.resolution import OUTCOMES, objective_limits
from cluster.hardware.states import State
from cluster.hardware.status import Phase

STATIC: Final = {"console.css": "text/css", "console.js": "text/javascript", "icon.svg": "image/svg+xml"}

_NEEDS: Final[Mapping[Phase, str]] = {
    Phase.READY: "The campaign goes on by itself, as long as its start command runs.",
    Phase.RUNNING: "The robot is moving, or may be.",
    Phase.AWAITS_APPROVAL: "It waits for you: look at what the robot will do, then approve or reject.",
    Phase.AWAITS_RESOLUTION: "It waits for you: nobody knows what the robot did. Look at it, then say.",
    Phase.STOPPED: "The robot is stopped.",
    Phase.RESTS: "The robot rests, as its limits say.",
    Phase.COMPLETE: "The campaign is complete.",
}


@dataclass(frozen=True)
class Stopper:
    """How a page stops the robot.

    Attributes:
        url: where its form goes; a process of its own answers there.
        key: what the form must hold.
    """

    url: str
    key: str


class Pages:
    """Makes every page.

    Args:
        desk: of the campaign.
        stopper: of the robot.
    """

    def __init__(self, desk: Desk, stopper: Stopper) -> None:
        self._desk, self._stopper = desk, stopper
        self._environment = Environment(
            loader=PackageLoader("cluster.console", "templates"),
            autoescape=True,
            undefined=StrictUndefined,
            trim_blocks=True,
            lstrip_blocks=True,
        )
        self._environment.filters |= {"number": number, "when": when, "told": facts_told}

    def now(self, session: BrowserSession, view: View) -> str:
        """Show what the campaign needs now, and the forms that give it that.

        Args:
            session: of who looks.
            view: of the campaign.

        Returns:
            The page.
        """
        trial = view.open_trial
        return self._page(
            "now",
            session,
            view,
            needs=_NEEDS[view.status.phase],
            trial=trial,
            motion=view.status.motion,
            clip=self._clip_of(trial.number) if trial else "",
            outcomes=OUTCOMES,
            limits=objective_limits(view.status.identity.setup),
            minutes=VALID_MINUTES,
        )

    def history(self, session: BrowserSession, view: View) -> str:
        """Show every trial, the best so far, and predictions beside measurements.

        Args:
            session: of who looks.
            view: of the campaign.

        Returns:
            The page.
        """
        measured = [row for row in view.rows if row["state"] == State.MEASURED]
        best = max(measured, key=lambda row: row["f"], default=None)
        return self._page("history", session, view, rows=view.rows, measured=measured, best=best)

    def trial(self, session: BrowserSession, view: View, number: int) -> str:
        """Show all that is known of one trial, and the forms that correct and complete it.

        Args:
            session: of who looks.
            view: of the campaign.
            number: of the trial.

        Returns:
            The page.
        """
        return self._page(
            "trial",
            session,
            view,
            row=view.rows[number],
            trial=view.status.trials[number],
            events=view.events_of(number),
            files=view.files_of(number),
            clip=self._clip_of(number),
            limits=objective_limits(view.status.identity.setup),
        )

    def enter(self, message: str) -> str:
        """Where a token is asked for."""
        return self._environment.get_template("enter.html.j2").render(message=message)

    def message(self, title: str, detail: str, back: str, session: BrowserSession | None) -> str:
        """Why something was not done.

        Args:
            title: in a few words.
            detail: in sentences.
            back: where the page leads.
            session: of who asked; without one, the page has no STOP.

        Returns:
            The page.
        """
        key = self._stopper.key if session else ""
        template = self._environment.get_template("message.html.j2")
        return template.render(title=title, detail=detail, back=back, stopper=self._stopper, key=key)

    def _page(self, name: str, session: BrowserSession, view: View, **content: Any) -> str:
        template = self._environment.get_template(f"{name}.html.j2")
        return template.render(
            page=name,
            view=view,
            status=view.status,
            session=session,
            stopper=self._stopper,
            home=self._desk.home,
            folder=self._desk.folder,
            **content,
        )

    def _clip_of(self, number: int) -> str:
        path = self._desk.clip(number)
        return "" if path is None else path.suffix


def static(name: str) -> bytes:
    """A style sheet or a script.

    Raises:
        KeyError: there is none of that name.
    """
    if name not in STATIC:
        raise KeyError(name)
    return resources.files("cluster.console").joinpath("static", name).read_bytes()
