"""Training of policies: `relign-train imitate`, `relign-train ppo` and `relign-train export`.

Needs torch and other packages from the Python index: pip install "./python[train]".
"""
