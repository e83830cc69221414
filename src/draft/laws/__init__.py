"""Actuator and structure laws: data, ranges and error bands."""
