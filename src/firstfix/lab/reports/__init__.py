"""Tables, pictures and documents of experiments."""
