"""The dynamic stage: adaptive Monte Carlo localization."""
