"""map_server maps."""
