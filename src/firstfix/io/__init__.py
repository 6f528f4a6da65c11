"""Bytes to core types and back."""
