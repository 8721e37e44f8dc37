"""The SVAE-DC networks and the file they are kept in."""
