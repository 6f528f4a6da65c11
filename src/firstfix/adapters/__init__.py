"""Between the system and the world: convert, call, publish."""
