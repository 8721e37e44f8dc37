"""What scenes are made of: the ground, cylinders, motors, and pairs of things that may touch.

Contacts have coefficients of their own for each pair, the products that Bullet takes, so that both engines
are told the same. MuJoCo has no coefficient of restitution: a contact there is a spring and a damper, and its
damping ratio is chosen for the same bounce.
"""

import math
from collections.abc import Sequence
from typing import Any

import mujoco

GROUND = "ground"
LINK_FRICTION = 0.5
"""Links whose URDF says nothing have this coefficient in Bullet."""
SPINNING_FRICTION = 1e-5
"""In m; MuJoCo needs one that is not 0, and Bullet has none."""
CONTACT_SECONDS = 0.02
"""It is MuJoCo's own time constant of contacts."""
_ROLLING, _SLIDING = 6, 3  # directions in which a contact resists


def set_time_step(spec: Any, seconds: float) -> None:
    """Set the engine's step; velocities are integrated implicitly, which stiff motors need.

    Args:
        spec: the scene.
        seconds: of a step.
    """
    spec.option.timestep = seconds
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST


def add_ground(spec: Any) -> None:
    """Add the plane z = 0."""
    spec.worldbody.add_geom(
        name=GROUND, type=mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 1.0), contype=0, conaffinity=0
    )


def add_cylinder(
    spec: Any, name: str, *, radius: float, height: float, position: tuple[float, float]
) -> None:
    """Add a cylinder that stands on the ground and may be pushed over; `set_mass` gives it a mass.

    Args:
        spec: the scene.
        name: of its body and geom.
        radius: in m.
        height: in m.
        position: (x, y) of its axis at reset, in m.
    """
    body = spec.worldbody.add_body(
        name=name,
        pos=(*position, height / 2),
        mass=1.0,
        ipos=(0.0, 0.0, 0.0),
        iquat=(1.0, 0.0, 0.0, 0.0),
        inertia=(1.0, 1.0, 1.0),
        explicitinertial=True,
    )
    body.add_freejoint(name=name)
    body.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=(radius, height / 2, 0.0),
        contype=0,
        conaffinity=0,
    )


def add_pair(spec: Any, one: str, other: str, *, rolls: bool) -> None:
    """Let two geoms touch; `set_contact` gives the pair its coefficients.

    Args:
        spec: the scene.
        one: geom.
        other: geom.
        rolls: whether the contact resists rolling and spinning as well as sliding.
    """
    spec.add_pair(
        name=pair_name(one, other),
        geomname1=one,
        geomname2=other,
        condim=_ROLLING if rolls else _SLIDING,
    )


def pair_name(one: str, other: str) -> str:
    """Name the pair of two geoms.

    Args:
        one: geom.
        other: geom, in the order of `add_pair`.

    Returns:
        The name.
    """
    return f"{one}:{other}"


def add_touch_sensor(spec: Any, body: str, *, with_children: bool) -> None:
    """Add a sensor that counts the contacts of a body with the ground.

    Args:
        spec: the scene.
        body: name.
        with_children: whether those of all bodies that hang on it count as well.
    """
    kind = mujoco.mjtObj.mjOBJ_XBODY if with_children else mujoco.mjtObj.mjOBJ_BODY
    spec.add_sensor(
        name=f"{body} touches the ground",
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=kind,
        objname=body,
        reftype=mujoco.mjtObj.mjOBJ_GEOM,
        refname=GROUND,
        intprm=(1, 0, 1),  # whether there is one; of any; one row
    )


def add_torque_motor(spec: Any, joint: str) -> None:
    """Add a motor whose command is a torque.

    Args:
        spec: the scene.
        joint: that it moves; commands are in N·m.
    """
    spec.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)


def add_servo(spec: Any, joint: str, *, stiffness: float, damping: float, torque: float) -> None:
    """Add a motor with the torque kp q* − kp q − kd q̇ for a commanded angle, or kd (q̇* − q̇) for a speed.

    Args:
        spec: the scene.
        joint: that it moves.
        stiffness: kp in N·m/rad; 0 for one whose command is a speed in rad/s.
        damping: kd in N·m·s/rad.
        torque: greatest, in N·m.
    """
    spec.add_actuator(
        name=joint,
        target=joint,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        gaintype=mujoco.mjtGain.mjGAIN_FIXED,
        gainprm=(stiffness or damping, *(0.0,) * 9),
        biastype=mujoco.mjtBias.mjBIAS_AFFINE,
        biasprm=(0.0, -stiffness, -damping, *(0.0,) * 7),
        forcelimited=True,
        forcerange=(-torque, torque),
    )


def set_joint(spec: Any, name: str, *, limits: tuple[float, float], damping: float) -> None:
    """Replace what the description says of a joint.

    Args:
        spec: the scene.
        name: of the joint.
        limits: lower and upper, in rad.
        damping: in N·m·s/rad.
    """
    joint = spec.joint(name)
    joint.limited, joint.range = True, limits
    joint.actfrclimited = False  # motors have limits of their own
    joint.damping = (damping, 0.0, 0.0)


def float_links(spec: Any, link: str) -> None:
    """Take the weight off a link and all that hangs on it, as the controllers of real arms do.

    Args:
        spec: the scene.
        link: name of its body.
    """
    first = spec.body(link)
    for body in (first, *first.find_all("body")):
        body.gravcomp = 1.0


def set_mass(model: Any, body: str, mass: float, inertia: Sequence[float]) -> None:
    """Set the mass of a body, and its principal moments of inertia.

    Args:
        model: compiled.
        body: name.
        mass: in kg.
        inertia: about the axes of its frame, in kg·m².
    """
    index = model.body(body).id
    model.body_mass[index] = mass
    model.body_inertia[index] = inertia


def set_contact(
    model: Any, pair: str, *, friction: float, rolling_friction: float, restitution: float
) -> None:
    """Set the coefficients of the contacts of a pair.

    Args:
        model: compiled.
        pair: name.
        friction: of sliding.
        rolling_friction: in m, as Bullet has it.
        restitution: share of the speed kept in a bounce, in [0, 1).
    """
    index = model.pair(pair).id
    rolling = max(rolling_friction, SPINNING_FRICTION)
    model.pair_friction[index] = (friction, friction, SPINNING_FRICTION, rolling, rolling)
    model.pair_solref[index] = (CONTACT_SECONDS, damping_ratio(restitution))


def damping_ratio(restitution: float) -> float:
    """ζ of the spring and damper that bounces so: e = exp(−π ζ / √(1 − ζ²)); 1 where nothing bounces."""
    if restitution <= 0.0:
        return 1.0
    logarithm = math.log(restitution)
    return -logarithm / math.hypot(math.pi, logarithm)
