"""Drawn buildings."""
