"""When to do what: from inputs to outputs, without a clock, a thread or a socket."""
