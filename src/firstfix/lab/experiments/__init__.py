"""Experiments: what `firstfix bench` runs."""
