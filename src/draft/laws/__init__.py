"""Actuator and structure laws, their data, and how far to trust them."""
