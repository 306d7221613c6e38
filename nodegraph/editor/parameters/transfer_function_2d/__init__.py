"""The editor of transfer functions over value and gradient magnitude: joint histogram, areas, colours."""
