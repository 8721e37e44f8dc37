"""Pictures of a trajectory: a scene is put into the states that ξ holds, or an artist draws them, one by one.

Nothing is simulated, and ξ is all that is needed: of an episode, from a dataset, or out of a model. The scene
is apart from that of the rollouts, which load nothing that is only seen.

Example:
    >>> from workers.rollout import random_episode
    >>> from workers.setups import load
    >>> setup = load("franka")
    >>> with setup.open() as environment:
    ...     xi = random_episode(setup, environment, seed=0, index=7).xi
    >>> [picture.shape for picture in frames(setup, xi, steps=[0, 499], size=Size(64, 48))]
    [(48, 64, 3), (48, 64, 3)]
"""

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, UInt8
from scipy.spatial.transform import Rotation

from workers.environments.environment import Channel
from workers.setups import Setup
from workers.simulation import shapes
from workers.simulation.artist import Artist
from workers.simulation.scenery import POSE_CHANNELS, Machine, Roll, Scenery, Vector
from workers.simulation.stage import Scene
from workers.user_code import UserCodeError

REACH = 32  # tiles of the ground drawn around every point the camera looks at
CALM = 1.0  # s, over which a camera that follows takes the mean of the positions
_WOOD = ((0.86, 0.66, 0.38), (0.72, 0.52, 0.28))
_TILES = ((0.93, 0.93, 0.90), (0.80, 0.82, 0.82), (0.66, 0.69, 0.71), (0.60, 0.63, 0.66))
_INK = (0.15, 0.2, 0.3)
_UPRIGHT = [0.0, 0.0, 0.0, 1.0]
_UNIT = np.eye(3)
_SMALL = 1e-3  # length below which a column of a rotation matrix has no direction

Trajectory = Float32[np.ndarray, "obs time"]
Picture = UInt8[np.ndarray, "height width 3"]
Pose = tuple[Float[np.ndarray, "3"], list[float]]
"""It is a position in m, [3], and an orientation as a quaternion (x, y, z, w)."""


@dataclass(frozen=True)
class Size:
    """Width and height of a picture in pixels, 16 to 4096 each."""

    width: int
    height: int

    def __post_init__(self) -> None:
        """Refuse pictures too small to show anything or too large to draw."""
        for name in ("width", "height"):
            if not 16 <= getattr(self, name) <= 4096:
                raise ValueError(f"{name} must be 16 to 4096 pixels, got {getattr(self, name)}")


def frames(
    setup: Setup, xi: Float32[np.ndarray, "obs time"], steps: Sequence[int], size: Size
) -> Iterator[UInt8[np.ndarray, "height width 3"]]:
    """Draw some steps of a trajectory.

    Args:
        setup: what the trajectory is of.
        xi: [obs, T], in the units of the setup's channels; rotations need not be exact.
        steps: indices into time, in any order.
        size: of every picture.

    Yields:
        One picture per step: red, green and blue, from the top left.

    Raises:
        ValueError: when ξ has other channels than the setup or is not finite.
        LookupError: when there is nothing to see.
    """
    if xi.shape[0] != len(setup.observation) or not np.isfinite(xi).all():
        raise ValueError(
            f"xi of {setup.name} must be {len(setup.observation)} channels × time of finite numbers, "
            f"got shape {xi.shape} with {np.count_nonzero(~np.isfinite(xi))} that are not finite"
        )
    scenery = scenery_of(setup)
    if isinstance(scenery, Scenery):
        yield from _staged_frames(scenery, setup, xi, steps, size)
    else:
        yield from _artist_frames(scenery, setup, xi, steps, size)


def _staged_frames(
    scenery: Scenery, setup: Setup, xi: Trajectory, steps: Sequence[int], size: Size
) -> Iterator[Picture]:
    with Scene() as stage:
        show = Show(stage, scenery, setup.observation)
        targets = show.targets(xi, setup.control_step)
        show.lay_ground(targets)
        for step in steps:
            show.pose(xi[:, step], targets[:, step])
            yield stage.picture(scenery.camera, size.width, size.height)


def _artist_frames(
    artist: Artist, setup: Setup, xi: Trajectory, steps: Sequence[int], size: Size
) -> Iterator[Picture]:
    names = [channel.name for channel in setup.observation]
    with closing(artist):
        for step in steps:
            state = dict(zip(names, xi[:, step].tolist(), strict=True))
            yield _require_picture(artist, artist.picture(state, size.width, size.height), size)


def _require_picture(artist: Artist, picture: Any, size: Size) -> Picture:
    drawn, shape = np.asarray(picture), (size.height, size.width, 3)
    if drawn.shape != shape or drawn.dtype != np.uint8:
        raise UserCodeError(
            f"{type(artist).__name__}.picture must return uint8 of shape {shape}, red, green and blue of "
            f"each pixel, got {drawn.dtype} of shape {drawn.shape}; workers.simulation.sketch.fit fits it in"
        )
    return drawn


def scenery_of(setup: Setup) -> Scenery | Artist:
    """What pictures of a setup show; a setup without anything to see raises `LookupError`."""
    with setup.open() as environment:
        scenery = environment.scenery
    if scenery is None:
        raise LookupError(f"{setup.name} has nothing to see: its environment declares no scenery")
    return scenery


class Show:
    """The bodies of a scenery on a stage, moved by columns of ξ."""

    def __init__(self, stage: Scene, scenery: Scenery, channels: Sequence[Channel]) -> None:
        self._stage = stage
        self._scenery = scenery
        self._rows = {channel.name: row for row, channel in enumerate(channels)}
        self.bodies = [self._add(model) for model in scenery.bodies]
        self._ground: list[int] = []

    def _add(self, model: Machine | Roll) -> list[int]:
        stage = self._stage
        if isinstance(model, Roll):
            return [stage.add_surface(part) for part in shapes.cylinder(model.radius, model.height, _WOOD)]
        return [stage.add_machine(model.urdf, model.joints)]

    def pose(self, column: Float32[np.ndarray, " obs"], target: Float[np.ndarray, "3"]) -> None:
        """Put every body where one step of ξ says, seen from the target: shadows fall well only around 0.

        Args:
            column: one step of ξ, [obs].
            target: the point looked at, in m, [3], drawn at the origin.
        """
        for model, bodies in zip(self._scenery.bodies, self.bodies, strict=True):
            if isinstance(model, Machine):
                self._stage.bend(bodies[0], column[[self._rows[name] for name in model.joints]].tolist())
            position, orientation = self._place(model.place, column)
            for body in bodies:
                self._stage.put(body, (position - target).tolist(), orientation)
        for body in self._ground:
            self._stage.put(body, (-target).tolist(), _UPRIGHT)

    def _place(self, place: Vector | str, column: Float32[np.ndarray, " obs"]) -> Pose:
        return (
            pose_of(column[self._pose_rows(place)]) if isinstance(place, str) else (np.array(place), _UPRIGHT)
        )

    def _pose_rows(self, place: str) -> list[int]:
        return [self._rows[f"{place}_{name}"] for name in POSE_CHANNELS]

    def targets(
        self, xi: Float32[np.ndarray, "obs time"], control_step: float
    ) -> Float[np.ndarray, "3 time"]:
        """Choose the point that the camera looks at in every step; one that follows does so calmly.

        Args:
            xi: the trajectory, [obs, T].
            control_step: s from one step to the next.

        Returns:
            The points, in m, [3, T].
        """
        camera = self._scenery.camera
        targets = np.repeat(np.array(camera.target)[:, None], xi.shape[1], axis=1)
        if camera.follows:
            position = xi[self._pose_rows(camera.follows)[:2]].astype(np.float64)
            targets[:2] += _smooth(position, round(CALM / control_step))
        return targets

    def lay_ground(self, targets: Float[np.ndarray, "3 time"]) -> None:
        """Tiles as far around every target as one can see."""
        model = self._scenery.ground
        reach = REACH * model.tile
        x, y = ((float(row.min()) - reach, float(row.max()) + reach) for row in targets[:2])
        parts = (*shapes.ground(model, x, y, _TILES), *shapes.numbers(model, y, _INK))
        self._ground = [self._stage.add_surface(part) for part in parts]


def pose_of(numbers: Float32[np.ndarray, "9"]) -> Pose:
    """Position and quaternion (x, y, z, w) of a pose in ξ, the rotation made exact by Gram and Schmidt.

    Columns without a direction, as of a trajectory that exploded at once, are replaced by the unit vectors.
    """
    position, first, second = numbers.astype(np.float64).reshape(3, 3)
    first = _direction(first, _UNIT[0])
    second = second - (second @ first) * first
    spare = _UNIT[np.argmin(np.abs(first))]
    second = _direction(second, _direction(spare - (spare @ first) * first, spare))
    rotation = Rotation.from_matrix(np.stack([first, second, np.cross(first, second)], axis=1))
    return position, rotation.as_quat().tolist()


def _direction(vector: np.ndarray, otherwise: np.ndarray) -> np.ndarray:
    length = float(np.linalg.norm(vector))
    return vector / length if length > _SMALL else otherwise


def _smooth(rows: Float[np.ndarray, "n time"], width: int) -> Float[np.ndarray, "n time"]:
    """Means over `width` steps around each, the ends repeated."""
    padded = np.pad(rows, ((0, 0), (width // 2, width - 1 - width // 2)), mode="edge")
    sums = np.cumsum(np.pad(padded, ((0, 0), (1, 0))), axis=1)
    return (sums[:, width:] - sums[:, :-width]) / width
