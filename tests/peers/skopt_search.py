"""scikit-optimize's own gp_minimize and forest_minimize as a plugin: the same instances, merits and clock as ours."""

import os

# One thread, as ours. Read when numpy is loaded.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from relign_bench.plugin import Optimizer, parameter, serve


class BudgetSpent(Exception):
    """Leaves skopt's loop."""


class SkoptSearch(Optimizer):
    id = "skopt"
    knows = ("merit", "start", "box")
    reproducible = "this_cpu"
    license = "Apache-2.0"
    presets = {"skopt-gp": {"estimator": "GP"}, "skopt-rf": {"estimator": "RF"}, "skopt-et": {"estimator": "ET"}}

    estimator = parameter("GP", allowed=["GP", "RF", "ET"], description="Gaussian process, random forest, extra trees")

    def run(self, talk):
        import warnings

        import skopt  # here: asking for the manifest needs no skopt

        warnings.filterwarnings("ignore")  # "evaluated at this point before", "did not converge"

        def merit(pose):
            seen = talk.step([float(value) for value in pose])
            if seen is None:
                raise BudgetSpent
            return seen.merit

        minimize = skopt.gp_minimize if self.estimator == "GP" else skopt.forest_minimize
        other = {} if self.estimator == "GP" else {"base_estimator": self.estimator}
        try:
            minimize(
                merit,
                list(zip(map(float, talk.box.lower), map(float, talk.box.upper))),
                n_calls=talk.budget,
                n_initial_points=min(10, talk.budget),
                random_state=talk.seed % 2**32,
                n_jobs=1,
                **other,
            )
        except BudgetSpent:
            pass


if __name__ == "__main__":
    serve(SkoptSearch)
