"""What a person is shown of a trial before they let it onto the robot: simulations, and a clip."""

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from cluster.errors import UserError
from cluster.files import replacing
from cluster.rendering.frames import clip, drawable, pictures, usual_speed
from cluster.rendering.video import write
from workers import setups
from workers.episode import Episode
from workers.hardware.preview import parameters, simulations, summary
from workers.setups import Setup

FOLDER: Final = "previews"
_WIDTH, _HEIGHT, _RATE = 320, 240, 10


@dataclass(frozen=True)
class Foresight:
    """How what waits for a person is simulated for them.

    Attributes:
        simulations: of each controller, under physics drawn from the ranges of data collection; 0 for none.
        clip: "gif" or "mp4", the kind of file in which the first of them is drawn; "none" for none.
    """

    simulations: int
    clip: str

    def of(self, folder: Path, setup: str, seed: int, trial: int, x: np.ndarray) -> dict[str, Any]:
        """Foresee one trial.

        Args:
            folder: of the campaign; the clip goes into it.
            setup: name of the robot's setup.
            seed: of the physics that are drawn.
            trial: its number.
            x: its controller, [D].

        Returns:
            Plain values: `x`, the parameters in their units; `simulated`, what simulations say; `clip`, the
            path of the clip, and `clip_missing`, why there is none. Nothing without simulations.
        """
        if not self.simulations:
            return {}
        known = setups.load(setup)
        simulated = list(simulations(known, x, seed, self.simulations))
        said = {"x": parameters(known, x), "simulated": summary(known, simulated, self.simulations)}
        if self.clip == "none" or not simulated:
            return said
        path = folder / FOLDER / f"trial-{trial:03d}.{self.clip}"
        return {**said, **_draw(known, simulated[0].episode, path)}


NO_FORESIGHT: Final = Foresight(0, "none")


def _draw(setup: Setup, episode: Episode, path: Path) -> dict[str, str]:
    """Draw an episode; what cannot be drawn, or a full disk, must not keep a trial from its person."""
    try:
        size = drawable(setup, path, _WIDTH, _HEIGHT)
        speed = usual_speed(setup)
        moments = clip(setup, episode, speed, _RATE)
        path.parent.mkdir(exist_ok=True)
        note = f"{setup.name} simulated {speed:.2g}x"
        with replacing(path) as unfinished:
            write(unfinished, path.suffix, pictures(setup, episode, moments, size, note), _RATE)
    except (UserError, OSError) as error:
        return {"clip_missing": str(error)}
    return {"clip": os.fspath(path)}
