"""Judging answers against the truth."""
