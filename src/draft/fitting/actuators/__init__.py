"""Actuator laws from the catalogue of modules."""
