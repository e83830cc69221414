"""Exploration of designs: screens, sweeps and searches."""
