"""Capabilities of real robots: by the maker's masses, by predicted ones, and as published."""
