"""Speed and memory, measured against hand-written peers: ``make bench``."""
