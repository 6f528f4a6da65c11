"""Pictures of answers and maps."""
