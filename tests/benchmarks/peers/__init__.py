"""Speed at equal error, measured against VTK: ``make bench-peers``, or ``python -m tests.benchmarks.peers [PART ...]``.

Two volume renderers of VTK (the GPU ray-caster on the same OpenGL, the fixed-point ray-caster on the processor) and
ours render the same scenes. What is compared is never a setting but an error: how long does each need for a picture
that is no farther from the converged one than VTK's own. Writes docs/peers.md.
"""
