"""PyBullet behind words of the domain; no other package imports it."""
