"""What nobody renders until somebody does, as data: `python -m tests.extremes` writes docs/extremes.md from it."""
