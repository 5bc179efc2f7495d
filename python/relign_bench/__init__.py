"""relign-bench for Python. `relign_bench.plugin` writes algorithms in Python; it needs the standard library alone."""
