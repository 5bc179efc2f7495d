"""An algorithm with pretraining: ../toy_learner in Python, byte for byte."""

from relign_bench.plugin import Optimizer, parameter, serve


class ToyLearner(Optimizer):
    id = "toy-learner"
    prepare = {"sources": "sources", "steps": 3}
    sources = parameter(2, minimum=1, maximum=4, description="How many")
    bytes = parameter(0, description="Additional bytes to save")
    trips_on = parameter(-1, description="The source on which it fails")

    def run(self, trial):
        pretraining = trial.pretraining()
        before = pretraining.load()
        if not pretraining.active:
            print("loaded", "nothing" if before is None else before.decode()[:1000])
            trial.step([0.1] * len(trial.axes))
            return
        if pretraining.source == self.trips_on:
            raise RuntimeError("tripped")
        seen = b"nothing" if before is None else before
        seen += b"; source %d of %d seed %d" % (pretraining.source, pretraining.sources, trial.seed)
        while (observed := trial.step([0.5] * len(trial.axes))) is not None:
            seen += b" %f" % observed.merit
        pretraining.save(seen + b"." * self.bytes)


if __name__ == "__main__":
    serve(ToyLearner)
