"""Writes tests/golden/forest_trees.json: trees of scikit-learn, for plugins/optimizers/bo_forest.

    python -m pip install scikit-learn
    python tests/peers/make_forest_golden.py
"""
import json
import pathlib

import numpy
import sklearn
from sklearn.tree import DecisionTreeRegressor


def case(name, seed, samples, axes, smallest_leaf, bootstrap):
    chance = numpy.random.default_rng(seed)
    features = chance.random((samples, axes)).astype(numpy.float32)
    optimum = chance.random(axes)
    targets = numpy.sum((features - optimum) ** 2, axis=1) + 0.02 * chance.standard_normal(samples)
    draws = chance.integers(0, samples, samples)
    copies = numpy.bincount(draws, minlength=samples) if bootstrap else numpy.ones(samples, dtype=int)
    kept = copies > 0

    tree = DecisionTreeRegressor(min_samples_leaf=smallest_leaf, random_state=0)
    tree.fit(features[kept], targets[kept], sample_weight=copies[kept].astype(float))
    queries = chance.random((600, axes)).astype(numpy.float32)
    # Two axes may split a node's samples equally; then the last bits of the sums decide. Only queries that do not depend on it
    # are kept: equal predictions for samples in any order, with tiny changes.
    agreed = numpy.ones(len(queries), dtype=bool)
    for state in range(100):
        order = chance.permutation(numpy.flatnonzero(kept))
        other = DecisionTreeRegressor(min_samples_leaf=smallest_leaf, random_state=state)
        changed = targets[order] * (1 + 1e-12 * chance.standard_normal(len(order)))
        other.fit(features[order], changed, sample_weight=copies[order].astype(float))
        agreed &= numpy.abs(other.predict(queries) - tree.predict(queries)) < 1e-9
    queries = queries[agreed][:200]
    leaves = tree.apply(queries)
    assert len(queries) == 200 and len(set(leaves)) > 2
    return {
        "name": name,
        "smallest_leaf": smallest_leaf,
        "features": features.astype(float).round(9).tolist(),
        "targets": targets.tolist(),
        "copies": copies.tolist(),
        "nodes": int(tree.tree_.node_count),
        "queries": queries.astype(float).round(9).tolist(),
        "means": tree.predict(queries).tolist(),
        "perturbations": tree.tree_.impurity[leaves].tolist(),
    }


def main():
    cases = [
        case("two axes, 20 samples", 1, 20, 2, 3, False),
        case("five axes, 50 samples, bootstrap", 2, 50, 5, 3, True),
        case("one axis, 40 samples, leaves of one", 3, 40, 1, 1, False),
        case("six axes, 120 samples, bootstrap", 4, 120, 6, 3, True),
    ]
    golden = {"made_by": f"tests/peers/make_forest_golden.py, scikit-learn {sklearn.__version__}", "cases": cases}
    path = pathlib.Path(__file__).resolve().parents[1] / "golden" / "forest_trees.json"
    path.write_text(json.dumps(golden, separators=(",", ":")).replace('{"name"', '\n{"name"') + "\n")


if __name__ == "__main__":
    main()
