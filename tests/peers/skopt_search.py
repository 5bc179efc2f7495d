"""scikit-optimize's gp_minimize and forest_minimize as a plugin: equal instances, merits and clock for all methods."""

import os

# One thread, as in relign-bench. numpy reads these when it is imported.
for library in ("OMP", "OPENBLAS", "MKL"):
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

from relign_bench.plugin import Optimizer, parameter, serve  # noqa: E402


class BudgetSpent(Exception):
    """Ends the loop of scikit-optimize."""


class SkoptSearch(Optimizer):
    id = "skopt"
    observes = ("merit", "start", "box")
    reproducible = "this_cpu"
    license = "Apache-2.0"
    presets = {"skopt-gp": {"estimator": "GP"}, "skopt-rf": {"estimator": "RF"}, "skopt-et": {"estimator": "ET"}}

    estimator = parameter("GP", allowed=["GP", "RF", "ET"], description="Gaussian process, random forest, extra trees")

    def run(self, trial):
        import warnings

        import skopt  # here, because the manifest does not need it

        warnings.filterwarnings("ignore")  # "evaluated at this point before", "did not converge"

        def merit(pose):
            observation = trial.step([float(value) for value in pose])
            if observation is None:
                raise BudgetSpent
            return observation.merit

        minimize = skopt.gp_minimize if self.estimator == "GP" else skopt.forest_minimize
        other = {} if self.estimator == "GP" else {"base_estimator": self.estimator}
        try:
            minimize(
                merit,
                list(zip(map(float, trial.box.lower), map(float, trial.box.upper))),
                n_calls=trial.budget,
                n_initial_points=min(10, trial.budget),
                random_state=trial.seed % 2**32,
                n_jobs=1,
                **other,
            )
        except BudgetSpent:
            pass


if __name__ == "__main__":
    serve(SkoptSearch)
