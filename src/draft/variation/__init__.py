"""Variation of numbers of a design: ranges, and samples drawn from them."""
