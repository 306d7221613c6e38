"""The timeline; what it moves is in nodegraph/animation.py."""
