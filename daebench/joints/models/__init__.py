"""Model files of robots, MJCF and URDF: read by MuJoCo, made into mechanisms of ``daebench.joints``, and written as Python."""
