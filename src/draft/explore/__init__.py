"""Exploring designs: metrics, screening, sweeps, search, reports, the studio."""
