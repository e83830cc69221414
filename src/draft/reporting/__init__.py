"""One page about a few designs, which opens offline: shapes, masses, actuators, findings."""
