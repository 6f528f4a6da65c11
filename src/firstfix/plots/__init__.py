"""Pictures of results and maps."""
