"""Estimates compared with ground truth."""
