"""Daisy, a HEBI X-series hexapod, as a URDF of primitive shapes, written from its facts.

Sources, of numbers only (no file is copied): HebiRobotics/hebi_description (masses, link frames, mounts,
limits of speed and torque), HebiRobotics/hebi-cpp-examples and hebi-matlab-examples (mounts). Sizes that none
of them states are marked "assumed". Forward is +y, left is −x, up is +z.
"""

from math import cos, pi, radians, sin
from typing import NamedTuple

import numpy as np

Vector = tuple[float, float, float]

LEFT, RIGHT = 1.0, -1.0
LEGS = {
    "LF": (LEFT, 120.0, 0.2375),
    "RF": (RIGHT, 60.0, 0.2375),
    "LM": (LEFT, 180.0, 0.1875),
    "RM": (RIGHT, 0.0, 0.1875),
    "LB": (LEFT, 240.0, 0.2375),
    "RB": (RIGHT, -60.0, 0.2375),
}
"""Each leg's mount has a side, a direction in degrees from +x, and a radius in m; joints keep the order."""
KINDS = ("base", "shoulder", "elbow")
JOINTS = tuple(f"{leg}_{kind}" for leg in LEGS for kind in KINDS)
SIDES = tuple(side for side, _, _ in LEGS.values() for _ in KINDS)
TORQUE = {"base": 20.0, "shoulder": 38.0, "elbow": 20.0}  # N·m, peak of X8-9, X8-16, X8-9
SPEED = {"base": 3.142, "shoulder": 1.571, "elbow": 3.142}  # rad/s, 30 and 15 rpm
LIMIT = pi  # rad, of every joint
JOINT_DAMPING = 0.5  # N·m·s/rad

MOUNT_PLANE = -0.05  # m below the origin of the body, which is the centre of its box
CHASSIS_MASS, CHASSIS_BOX = 5.0, (0.24, 0.36, 0.10)  # kg; m, the sizes assumed
CHASSIS_CENTER = (0.0, 0.050, 0.075)  # m, of mass, from the mounts' plane
ACTUATOR_MASS, ACTUATOR_CENTER = 0.480, 0.0242  # kg, X8-9; m above the mounts' plane
ACTUATOR_INERTIA = (2.46e-4, 3.80e-4, 4.63e-4)  # kg·m²
COXA_MASS, COXA_CENTER = 0.715, (0.0, 0.0, 0.045)  # bracket and X8-16 body
TUBE_MASS, TUBE_LENGTH, TUBE_RADIUS = 0.402, 0.325, 0.016
TUBE_ASIDE = 0.020  # m beside the actuator's output
FOOT_MASS, FOOT_RADIUS = 0.060, 0.025  # radius assumed: tube and rubber
HOUSING_RADIUS = 0.04  # m, of the sphere that stands for an actuator's body, assumed
OUTPUT_HEIGHT = 0.045  # m, of an X8 above its mount
PLATE, ACTUATOR, TUBE, RUBBER = "0.30 0.32 0.36", "0.80 0.16 0.14", "0.88 0.88 0.86", "0.12 0.12 0.13"
"""In pictures the parts have these colours: red, green and blue, from 0 to 1."""
FRONT_MARK = "0.12 0.04 0.004"  # m, of a plate on the chassis that is only seen


class Solid(NamedTuple):
    """Mass in kg, centre of mass in m, and principal moments of inertia about it in kg·m²."""

    mass: float
    center: Vector
    inertia: Vector


def combine(parts: tuple[Solid, ...]) -> Solid:
    """Several solids as one, by the parallel axis theorem; products of inertia are left out."""
    masses = np.array([part.mass for part in parts])
    centers = np.array([part.center for part in parts])
    center = masses @ centers / masses.sum()
    squares = (centers - center) ** 2
    steiner = masses @ (squares.sum(axis=1, keepdims=True) - squares)
    inertia = np.array([part.inertia for part in parts]).sum(axis=0) + steiner
    return Solid(float(masses.sum()), _vector(center), _vector(inertia))


def body() -> Solid:
    """Chassis and the six actuators at the hips, about the origin of the body."""
    wide, long, high = CHASSIS_BOX
    squares = (long**2 + high**2, wide**2 + high**2, wide**2 + long**2)
    inertia = _vector(CHASSIS_MASS / 12 * np.array(squares))
    x, y, z = CHASSIS_CENTER
    chassis = Solid(CHASSIS_MASS, (x, y, z + MOUNT_PLANE), inertia)
    hips = (
        Solid(ACTUATOR_MASS, (*_mount(leg), ACTUATOR_CENTER + MOUNT_PLANE), ACTUATOR_INERTIA) for leg in LEGS
    )
    return combine((chassis, *hips))


def _femur() -> Solid:
    end = Solid(ACTUATOR_MASS, (TUBE_LENGTH, 0.0, 0.0), ACTUATOR_INERTIA)
    return combine((_tube(0.0), end))


def _tibia(side: float) -> Solid:
    ball = 0.4 * FOOT_MASS * FOOT_RADIUS**2
    foot = Solid(FOOT_MASS, (TUBE_LENGTH, -side * TUBE_ASIDE, 0.0), (ball, ball, ball))
    return combine((_tube(-side * TUBE_ASIDE), foot))


def _tube(aside: float) -> Solid:
    across = TUBE_MASS * (3 * TUBE_RADIUS**2 + TUBE_LENGTH**2) / 12
    along = TUBE_MASS * TUBE_RADIUS**2 / 2
    return Solid(TUBE_MASS, (TUBE_LENGTH / 2, aside, 0.0), (along, across, across))


def _coxa() -> Solid:
    scale = COXA_MASS / ACTUATOR_MASS
    return Solid(COXA_MASS, COXA_CENTER, _vector(scale * np.array(ACTUATOR_INERTIA)))


def _mount(leg: str) -> tuple[float, float]:
    _, degrees, radius = LEGS[leg]
    return radius * cos(radians(degrees)), radius * sin(radians(degrees))


def _vector(numbers: np.ndarray) -> Vector:
    x, y, z = numbers.tolist()
    return x, y, z


def urdf() -> str:
    """The robot's description; joints and links in the order of `JOINTS`."""
    box = f'<box size="{_numbers(CHASSIS_BOX)}"/>'
    x, y, z = 0.0, 0.36 * CHASSIS_BOX[1], CHASSIS_BOX[2] / 2
    plate = _shape((x, y, z), f'<box size="{FRONT_MARK}"/>')
    mark = f"<visual>{plate}{_material(ACTUATOR)}</visual>"
    parts = [_link("body", body(), _part((0.0, 0.0, 0.0), box, PLATE) + mark)]
    for leg in LEGS:
        parts += _leg(leg)
    return "\n".join(['<robot name="daisy">', *parts, "</robot>"])


def _leg(leg: str) -> list[str]:
    side, degrees, _ = LEGS[leg]
    mount = (*_mount(leg), MOUNT_PLANE + OUTPUT_HEIGHT)
    tube_end = (TUBE_LENGTH, -side * TUBE_ASIDE, 0.0)
    housing = _part((TUBE_LENGTH, 0.0, 0.0), _sphere(HOUSING_RADIUS), ACTUATOR)
    return [
        _joint(leg, "base", "body", (mount, radians(degrees)), (0.0, 0.0, 1.0)),
        _link(f"{leg}_coxa", _coxa(), _part(COXA_CENTER, _sphere(HOUSING_RADIUS), ACTUATOR)),
        _joint(leg, "shoulder", f"{leg}_coxa", ((0.0, side * 0.0225, 0.055), 0.0), (0.0, side, 0.0)),
        _link(f"{leg}_femur", _femur(), _tube_part(-side * TUBE_ASIDE) + housing),
        _joint(leg, "elbow", f"{leg}_femur", ((TUBE_LENGTH, -side * 0.045, 0.0), 0.0), (0.0, -side, 0.0)),
        _link(
            f"{leg}_tibia",
            _tibia(side),
            _tube_part(-side * TUBE_ASIDE) + _part(tube_end, _sphere(FOOT_RADIUS), RUBBER),
        ),
    ]


_CHILD = {"base": "coxa", "shoulder": "femur", "elbow": "tibia"}


def _joint(leg: str, kind: str, parent: str, origin: tuple[Vector, float], axis: Vector) -> str:
    place, turn = origin
    return (
        f'<joint name="{leg}_{kind}" type="revolute"><parent link="{parent}"/>'
        f'<child link="{leg}_{_CHILD[kind]}"/><origin xyz="{_numbers(place)}" rpy="0 0 {turn:.12g}"/>'
        f'<axis xyz="{_numbers(axis)}"/><dynamics damping="{JOINT_DAMPING}" friction="0"/>'
        f'<limit lower="{-LIMIT:.12g}" upper="{LIMIT:.12g}" effort="{TORQUE[kind]}"'
        f' velocity="{SPEED[kind]}"/></joint>'
    )


def _link(name: str, solid: Solid, parts: str) -> str:
    xx, yy, zz = solid.inertia
    return (
        f'<link name="{name}"><inertial><origin xyz="{_numbers(solid.center)}"/>'
        f'<mass value="{solid.mass:.12g}"/><inertia ixx="{xx:.12g}" iyy="{yy:.12g}" izz="{zz:.12g}"'
        f' ixy="0" ixz="0" iyz="0"/></inertial>{parts}</link>'
    )


def _tube_part(aside: float) -> str:
    capsule = f'<capsule radius="{TUBE_RADIUS}" length="{TUBE_LENGTH}"/>'
    return _part((TUBE_LENGTH / 2, aside, 0.0), capsule, TUBE, pitch=pi / 2)


def _part(place: Vector, shape: str, color: str, pitch: float = 0.0) -> str:
    """The shape, to touch and to see."""
    inside = _shape(place, shape, pitch)
    return f"<visual>{inside}{_material(color)}</visual><collision>{inside}</collision>"


def _shape(place: Vector, shape: str, pitch: float = 0.0) -> str:
    return f'<origin xyz="{_numbers(place)}" rpy="0 {pitch:.12g} 0"/><geometry>{shape}</geometry>'


def _material(color: str) -> str:
    return f'<material name="{color}"><color rgba="{color} 1"/></material>'


def _sphere(radius: float) -> str:
    return f'<sphere radius="{radius}"/>'


def _numbers(vector: tuple[float, ...]) -> str:
    return " ".join(f"{number:.12g}" for number in vector)
