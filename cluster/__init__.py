"""The shell: command line, Ray drivers, hardware journal and tracking; it computes nothing itself."""
