"""The text of `urdf/yumi.urdf`: an ABB YuMi of capsules and boxes, whose right arm moves.

Joints are those that the public descriptions of the IRB 14000 agree on, capsules were fitted to the robot's
outline; `urdf/SOURCES.md` says where each number comes from. To write the file anew:

    python -m workers.environments.yumi_description > workers/environments/urdf/yumi.urdf
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import pi
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

Triple = tuple[float, float, float]


class Joint(NamedTuple):
    """A revolute joint about its own z: ABB's number, origin (m, rad) in its parent, limits (rad, rad/s)."""

    number: int
    xyz: Triple
    rpy: Triple
    lower: float
    upper: float
    speed: float


@dataclass(frozen=True)
class Capsule:
    """A solid capsule: both ends of its axis in the link's frame, and its radius, in m."""

    start: Triple
    end: Triple
    radius: float

    @property
    def length(self) -> float:
        """Of the cylindrical part, in m."""
        return float(np.linalg.norm(np.subtract(self.end, self.start)))

    @property
    def volume(self) -> float:
        """In m³."""
        return pi * self.radius**2 * (self.length + 4 / 3 * self.radius)

    @property
    def frame(self) -> tuple[np.ndarray, Rotation]:
        """Centre, and the rotation that turns z onto the axis."""
        axis = np.subtract(self.end, self.start)
        return np.add(self.start, self.end) / 2, Rotation.align_vectors([axis], [(0.0, 0.0, 1.0)])[0]

    def moments(self, mass: float) -> tuple[float, float]:
        """Principal moments of inertia in kg·m²: across the axis, and about it."""
        h, r = self.length, self.radius
        cylinder = mass * h / (h + 4 / 3 * r)
        caps = mass - cylinder
        across = cylinder * (h**2 / 12 + r**2 / 4) + caps * (2 / 5 * r**2 + h**2 / 4 + 3 / 8 * h * r)
        return across, cylinder * r**2 / 2 + caps * 2 / 5 * r**2


_HALF = pi / 2
ARM = (  # shoulder to wrist: joint 7 is the third
    Joint(1, (0.05355, -0.0725, 0.41492), (-0.9795, -0.5682, -2.3155), -2.9409, 2.9409, 3.1416),
    Joint(2, (0.03, 0.0, 0.1), (_HALF, 0.0, 0.0), -2.5045, 0.7592, 3.1416),
    Joint(7, (-0.03, 0.17283, 0.0), (-_HALF, 0.0, 0.0), -2.9409, 2.9409, 3.1416),
    Joint(3, (-0.04188, 0.0, 0.07873), (_HALF, -_HALF, 0.0), -2.1555, 1.3963, 3.1416),
    Joint(4, (0.0405, 0.16461, 0.0), (-_HALF, 0.0, 0.0), -5.0615, 5.0615, 6.9813),
    Joint(5, (-0.027, 0.0, 0.10039), (_HALF, 0.0, 0.0), -1.5359, 2.4086, 6.9813),
    Joint(6, (0.027, 0.029, 0.0), (-_HALF, 0.0, 0.0), -3.9968, 3.9968, 6.9813),
)
LEFT_SHOULDER = ((0.05355, 0.0725, 0.41492), (0.9781, -0.5716, 2.3180))  # the rest of the arm is the same
LEFT_REST = (-0.4479, -1.2683, 1.9586, 0.4285, 0.9854, -0.0242, -0.5602)  # rad; it never moves
CAPSULES = (  # of the links 1 to 7, shoulder to wrist
    Capsule((-0.005, 0.003, 0.010), (0.029, -0.046, 0.107), 0.045),
    Capsule((-0.002, -0.009, -0.036), (-0.032, 0.144, 0.003), 0.047),
    Capsule((-0.047, -0.045, 0.087), (0.004, -0.003, 0.020), 0.040),
    Capsule((0.001, -0.010, -0.033), (0.045, 0.132, 0.003), 0.044),
    Capsule((-0.022, -0.052, 0.097), (0.003, -0.002, 0.009), 0.031),
    Capsule((0.018, -0.012, -0.009), (0.008, -0.010, -0.015), 0.048),
    Capsule((0.0, 0.0, -0.0005), (0.0, 0.0, 0.0005), 0.026),  # as large as the flange, for its mass
)
ARM_MASS = 9.5  # kg; shared among the links by volume
GRIPPER_MASS = 0.22  # kg
DAMPING = 0.5  # N·m·s/rad
EFFORT = 30.0  # N·m, of the motors of `workers.setups.yumi`

_FLANGE = '<cylinder radius="0.032" length="0.023"/>'
_PALM = ('<box size="0.080 0.066 0.092"/>', (0.0, 0.0, 0.053))
_FINGERS = ('<box size="0.020 0.020 0.020"/>', (0.0, 0.0, 0.105))
_CHEST = (('<box size="0.30 0.36 0.30"/>', (-0.14, 0.0, 0.23), (0.0, 0.0, 0.0)),)
_NECK = (('<capsule radius="0.10" length="0.06"/>', (0.0, 0.0, 0.38), (_HALF, 0.0, 0.0)),)


def lines() -> Iterator[str]:
    """The description, line by line."""
    yield '<?xml version="1.0"?>'
    yield "<!-- ABB YuMi IRB 14000, written by workers/environments/yumi_description.py. Lengths in m. -->"
    yield '<robot name="yumi">'
    yield '  <material name="shell"><color rgba="0.85 0.85 0.83 1"/></material>'
    yield '  <material name="dark"><color rgba="0.25 0.25 0.27 1"/></material>'
    yield from _body()
    parents = ("yumi_body", *(f"yumi_link_{place}_r" for place in range(1, 8)))
    density = ARM_MASS / sum(capsule.volume for capsule in CAPSULES)
    for joint, capsule, (parent, link) in zip(ARM, CAPSULES, pairwise(parents), strict=True):
        yield from _link(link, capsule, density * capsule.volume)
        yield from _joint(joint, parent, link)
    yield from _gripper(parents[-1])
    yield "</robot>"


def _body() -> Iterator[str]:
    """Torso, head, and the left arm as a picture of itself at rest."""
    yield '  <link name="yumi_body">'
    yield from _inertial((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 15.0, (0.5, 0.6, 0.3))
    for geometry, xyz, rpy in (*_CHEST, *_NECK):
        yield from _shape("visual", geometry, xyz, rpy)
        yield from _shape("collision", geometry, xyz, rpy)
    origin, rotation = np.zeros(3), Rotation.identity()
    left = ((ARM[0]._replace(xyz=LEFT_SHOULDER[0], rpy=LEFT_SHOULDER[1])), *ARM[1:])
    for joint, angle, capsule in zip(left, LEFT_REST, CAPSULES, strict=True):
        origin = origin + rotation.apply(joint.xyz)
        rotation = rotation * Rotation.from_euler("xyz", joint.rpy) * Rotation.from_rotvec((0, 0, angle))
        center, turn = capsule.frame
        euler = (rotation * turn).as_euler("xyz")
        yield from _shape("visual", _capsule(capsule), origin + rotation.apply(center), euler)
    yield "  </link>"


def _link(name: str, capsule: Capsule, mass: float) -> Iterator[str]:
    center, turn = capsule.frame
    across, along = capsule.moments(mass)
    is_flange = capsule is CAPSULES[-1]
    geometry = _FLANGE if is_flange else _capsule(capsule)
    rpy = turn.as_euler("xyz")
    yield f'  <link name="{name}">'
    yield from _inertial(center, rpy, mass, (across, across, along))
    yield from _shape("visual", geometry, center, rpy)
    yield from _shape("collision", geometry, center, rpy)
    yield "  </link>"


def _joint(joint: Joint, parent: str, child: str) -> Iterator[str]:
    yield f'  <joint name="yumi_joint_{joint.number}_r" type="revolute">'
    yield f'    <parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/>'
    yield f"    {_origin(joint.xyz, joint.rpy)}"
    limits = f'lower="{joint.lower}" upper="{joint.upper}" velocity="{joint.speed}" effort="{EFFORT}"'
    yield f"    <limit {limits}/>"
    yield f'    <dynamics damping="{DAMPING}"/>'
    yield "  </joint>"


def _gripper(parent: str) -> Iterator[str]:
    """The gripper with its fingers shut and short, as one body on the flange."""
    yield '  <link name="yumi_gripper_r">'
    a, b, c = 0.080, 0.066, 0.092
    moments = tuple(GRIPPER_MASS / 12 * sides for sides in (b**2 + c**2, a**2 + c**2, a**2 + b**2))
    yield from _inertial(_PALM[1], (0.0, 0.0, 0.0), GRIPPER_MASS, moments)
    for geometry, xyz in (_PALM, _FINGERS):
        yield from _shape("visual", geometry, xyz, (0.0, 0.0, 0.0), "dark")
        yield from _shape("collision", geometry, xyz, (0.0, 0.0, 0.0))
    yield "  </link>"
    yield '  <joint name="yumi_gripper_joint_r" type="fixed">'
    yield f'    <parent link="{parent}"/><child link="yumi_gripper_r"/>'
    yield f"    {_origin((0.0, 0.0, 0.007), (0.0, 0.0, pi))}"
    yield "  </joint>"


def _shape(kind: str, geometry: str, xyz: object, rpy: object, material: str = "shell") -> Iterator[str]:
    paint = f'<material name="{material}"/>' if kind == "visual" else ""
    yield f"    <{kind}>{_origin(xyz, rpy)}<geometry>{geometry}</geometry>{paint}</{kind}>"


def _inertial(xyz: object, rpy: object, mass: float, moments: tuple[float, ...]) -> Iterator[str]:
    ixx, iyy, izz = (f"{moment:.4e}" for moment in moments)
    products = 'ixy="0" ixz="0" iyz="0"'
    yield f'    <inertial>{_origin(xyz, rpy)}<mass value="{mass:.4f}"/>'
    yield f'      <inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" {products}/></inertial>'


def _origin(xyz: object, rpy: object) -> str:
    return f'<origin xyz="{_numbers(xyz)}" rpy="{_numbers(rpy)}"/>'


def _capsule(capsule: Capsule) -> str:
    """Not of the URDF standard; Bullet reads it."""
    return f'<capsule radius="{capsule.radius}" length="{capsule.length:.5f}"/>'


def _numbers(values: object) -> str:
    # Adding 0 turns the -0 of a rounded number into 0.
    return " ".join(f"{number + 0.0:.8g}" for number in np.round(np.asarray(values, dtype=float), 7))


if __name__ == "__main__":
    sys.stdout.write("\n".join(lines()) + "\n")
