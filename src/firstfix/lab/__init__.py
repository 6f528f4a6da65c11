"""The laboratory: how good is it."""
