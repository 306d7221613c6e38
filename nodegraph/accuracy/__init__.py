"""How wrong a result is, what it costs, and the cheapest settings that are right enough. See docs/accuracy.md."""
