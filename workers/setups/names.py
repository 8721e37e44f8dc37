"""The names of the setups that ship; importing them costs no time."""

from workers.names import require_known

__all__ = ["SETUPS", "require_known"]

SETUPS = {
    "franka": "workers.setups.franka:franka",
    "daisy-27d": "workers.setups.daisy:daisy_27d",
    "daisy-11d": "workers.setups.daisy:daisy_11d",
    "franka-mujoco": "workers.setups.franka:franka_mujoco",
    "yumi-mujoco": "workers.setups.yumi:yumi_mujoco",
    "daisy-27d-mujoco": "workers.setups.daisy:daisy_27d_mujoco",
    "daisy-11d-mujoco": "workers.setups.daisy:daisy_11d_mujoco",
    "daisy-11d-rehearsal": "workers.setups.daisy:daisy_11d_rehearsal",
    "quadratic-30d": "workers.setups.quadratic:quadratic_30d",
    "quadratic-30d-intrinsic-3": "workers.setups.quadratic:quadratic_30d_intrinsic_3",
    "franka-rehearsal": "workers.setups.franka:franka_rehearsal",
    "yumi": "workers.setups.yumi:yumi",
    "yumi-rehearsal": "workers.setups.yumi:yumi_rehearsal",
}
"""These setups ship; each name leads to the module and the function that makes it. A new robot is one module,
and one line here for each of its variants. One of the user's own needs no line."""
