"""The process at a robot: one motion at a time, within limits, and a stop that works. Standard library only.

It runs in the environment of the robot's driver, which may be another Python (3.10 or newer) without any of
this project's libraries; nothing here imports them.
"""
