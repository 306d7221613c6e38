"""Speed and memory, measured against hand-written peers: ``make bench``.

Every module ``bench_*.py`` here offers ``rows() -> Iterator[Row]``; ``python -m tests.benchmarks [NAME ...]`` runs
them all, or those named, prints the rows and writes them into docs/performance.md.
"""
