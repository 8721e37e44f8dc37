"""The operator's console: a campaign in a browser, on the robot's own computer."""
