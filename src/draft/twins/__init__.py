"""Robots that exist: a vendor's description as a spec."""
