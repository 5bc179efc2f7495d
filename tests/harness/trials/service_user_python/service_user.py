"""Calls services according to a script and prints their answers: service_user.cpp in Python, word for word."""
import json
import math
import time

from relign_bench.plugin import Optimizer, parameter, serve


def number(value):
    return None if math.isnan(value) else value


def shown(seen):
    if seen is None:
        return None
    return {"step": seen.step, "pose": list(seen.pose), "merit": number(seen.merit), "image": has_image(seen)}


def has_image(seen):
    try:
        return seen.image is not None
    except RuntimeError:
        return False


def log(what, value):
    print(what, json.dumps(value))


class ServiceUser(Optimizer):
    id = "service_user_python"
    observes = ("images", "merit", "start", "box", "design", "level", "history")
    script = parameter([], description="A list of what to do: [verb, values...].")
    then = parameter("../fake_optimizer", type="algorithm", description="Runs on the verb run.")

    def run(self, trial):
        for verb, *values in self.script:
            try:
                getattr(self, "on_" + verb)(trial, *values)
            except Exception as error:
                log("refused", str(error))

    def on_reference(self, trial):
        image = trial.reference
        height, width = image.shape
        log("reference", [width, height, sum(float(image[y, x]) for y in range(height) for x in range(width))])

    def on_measure(self, trial, name, arguments={}):
        log("measure", number(trial.measures().measure(name, arguments)))

    def on_fields(self, trial, arguments):
        log("fields", [{key: value if key == "name" else number(value) for key, value in field.items()}
                       for field in trial.measures().fields(arguments)])

    def on_select(self, trial, regions):
        log("select", trial.regions().select(regions))

    def on_list(self, trial):
        log("list", trial.measures().list())

    def on_draw(self, trial, which):
        log("draw", json.dumps(trial.prior().draw(which), separators=(",", ":"), sort_keys=True))

    def on_history(self, trial):
        history = trial.history()
        log("history", [history.cure_shift(back) for back in range(1, history.modules + 1)])

    def on_model(self, trial, offsets, pose, seed):
        with trial.model().mount(offsets) as lens:
            noisy, clean = lens.capture(pose, seed), lens.noise_free(pose)
        height, width = noisy.shape
        log("model", [height * width, float(noisy[0, 0]), None if clean is None else float(clean[0, 0])])

    def on_lens(self, trial, pose, seed, name, arguments):
        with trial.model().mount() as lens:
            if seed >= 0:
                lens.capture(pose, seed)
            value, fields = lens.measure(name), lens.fields(pose, arguments)
        columns = ("x_px", "y_px", "tangential", "sagittal")
        log("lens", [value, fields and [[field[name] for name in columns] for field in fields]])

    def on_slopes(self, trial, pose, seed, samples, elements):
        with trial.model().mount() as lens:
            images = lens.slopes(pose, seed, samples, elements)
        log("slopes", [[float(image[0, 0]), float(image[-1, -1])] for image in images])

    def on_model_nap(self, trial, milliseconds):
        with trial.model().mount() as lens:
            end = time.monotonic() + milliseconds / 1000
            while time.monotonic() < end:
                lens.capture([0.5] * len(trial.axes), 1)

    def on_keep_lens(self, trial):
        self.kept = trial.model().mount()

    def on_run(self, trial, name, steps, parameters={}):
        outcome = trial.run(name, steps, **parameters)
        log(
            "run",
            {
                "steps": outcome.steps,
                "finished": outcome.finished,
                "last": shown(outcome.last),
                "best": shown(outcome.best),
                "recommendation": outcome.recommendation,
            },
        )

    def on_load(self, trial):
        data = trial.pretraining().load()
        log("load", [trial.pretraining().active, None if data is None else data.decode("latin-1")])

    def on_save(self, trial, text):
        trial.pretraining().save(text.encode("latin-1"))

    def on_step(self, trial, pose):
        log("step", shown(trial.step(pose)))

    def on_recommend(self, trial, pose):
        trial.recommend(pose)


if __name__ == "__main__":
    serve(ServiceUser)
