"""CMA-ES of the Python package cmaes: ask for a pose, tell its merit."""
import numpy as np
from cmaes import CMA

from relign_bench.plugin import Optimizer, parameter, serve


class CmaesSearch(Optimizer):
    id = "cmaes_search"
    summary = "CMA-ES of the Python package cmaes; recommends the pose of the lowest merit."
    license = "Apache-2.0"
    citation = "Nomura, Shibata, cmaes: A Simple yet Practical Python Library for CMA-ES, arXiv 2402.01373, 2024."
    observes = ("merit", "start", "box")
    reproducible = "this_cpu"  # numpy's linear algebra rounds differently on other processors

    sigma = parameter(0.15, minimum=0.001, maximum=1.0, unit="share of the travel",
                      description="Standard deviation of the first generation, per axis")
    population = parameter(6, minimum=4, maximum=100, description="Poses of a generation")

    def run(self, trial):
        box = np.array([trial.box.lower, trial.box.upper]).T
        best = trial.first
        search = CMA(mean=np.array(best.pose, dtype=float), sigma=self.sigma, bounds=box, seed=trial.seed % 2**32,
                     population_size=int(self.population))
        while not search.should_stop():
            generation = []
            for _ in range(search.population_size):
                pose = search.ask()
                observation = trial.step(trial.box.clamp(pose.tolist()))
                if observation is None:  # budget spent
                    return
                generation.append((pose, observation.merit))
                if observation.merit < best.merit:
                    best = observation
                    trial.recommend(best.pose)
            search.tell(generation)


if __name__ == "__main__":
    serve(CmaesSearch)
