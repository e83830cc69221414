"""From a robot description, URDF or MJCF, to a spec folder."""
