"""Adaptive Monte Carlo localization (AMCL)."""
