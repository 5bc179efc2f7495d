"""APOSMM of libEnsemble: local searches (Nelder-Mead of SciPy) from the best of random points."""
from gest_api.vocs import VOCS
from libensemble.gen_classes.aposmm import APOSMM

from relign_bench.plugin import GeneratorSearch, parameter, serve

CUBE = "_on_cube"  # APOSMM works on the unit cube, and has every variable twice


class Aposmm:
    """APOSMM, which takes no measurements but its own, as a generator of the box alone."""

    def __init__(self, space, sample):
        self._space = space
        cube = [name + CUBE for name in space.names]
        variables = {**dict(zip(space.names, map(list, space.bounds))), **{name: [0, 1] for name in cube}}
        self._generator = APOSMM(VOCS(variables=variables, objectives={"merit": "MINIMIZE"}), max_active_runs=1,
                                 initial_sample_size=sample, random_seed=space.seed,
                                 variables_mapping={"x": space.names, "x_on_cube": cube, "f": ["merit"]})
        self._asked = {}

    def suggest(self, number):
        points = self._generator.suggest(number)
        self._asked.update({point["_id"]: point for point in points})
        return [{name: point[name] for name in (*self._space.names, "_id")} for point in points]

    def ingest(self, results):
        for result in results:
            if "_id" in result:
                self._generator.ingest([{**self._asked.pop(result["_id"]), "merit": result["merit"]}])

    def finalize(self):
        self._generator.finalize()


class AposmmSearch(GeneratorSearch):
    id = "libensemble-aposmm"
    license = "BSD-3-Clause"
    citation = "Larson and Wild, Asynchronously parallel optimization solver for finding multiple minima, MPC 2018."
    reproducible = "this_cpu"

    sample = parameter(10, minimum=1, description="Random points before the first local search")

    def generator(self, space):
        return Aposmm(space, self.sample)


if __name__ == "__main__":
    serve(AposmmSearch)
