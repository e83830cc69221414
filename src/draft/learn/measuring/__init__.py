"""Measuring what a policy can do, and what bodies can do with it."""
