"""Training of agents: `relign-train imitate`. Needs torch, from the Python index: pip install "relign-bench[train]"."""
