"""Controllers of a policy for a robot, in plain C++ and in plain Python."""
