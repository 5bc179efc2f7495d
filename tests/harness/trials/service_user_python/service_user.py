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
    knows = ("images", "merit", "start", "box", "design", "level")
    script = parameter([], description="A list of what to do: [verb, values...].")
    then = parameter("../fake_optimizer", type="algorithm", description="Runs on the verb run.")

    def run(self, talk):
        for verb, *values in self.script:
            try:
                getattr(self, "on_" + verb)(talk, *values)
            except Exception as error:
                log("refused", str(error))

    def on_reference(self, talk):
        image = talk.reference
        height, width = image.shape
        log("reference", [width, height, sum(float(image[y, x]) for y in range(height) for x in range(width))])

    def on_measure(self, talk, name, arguments={}):
        log("measure", number(talk.measure(name, **arguments)))

    def on_list(self, talk):
        log("list", talk.measures())

    def on_draw(self, talk, which):
        log("draw", json.dumps(talk.draw_prior(which), separators=(",", ":"), sort_keys=True))

    def on_model(self, talk, offsets, pose, seed):
        with talk.model().mount(offsets) as lens:
            noisy, clean = lens.capture(pose, seed), lens.noise_free(pose)
        height, width = noisy.shape
        log("model", [height * width, float(noisy[0, 0]), None if clean is None else float(clean[0, 0])])

    def on_model_nap(self, talk, milliseconds):
        with talk.model().mount() as lens:
            end = time.monotonic() + milliseconds / 1000
            while time.monotonic() < end:
                lens.capture([0.5] * len(talk.axes), 1)

    def on_keep_lens(self, talk):
        self.kept = talk.model().mount()

    def on_run(self, talk, name, steps, parameters={}):
        outcome = talk.run(name, steps, **parameters)
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

    def on_load(self, talk):
        data = talk.prepared().load()
        log("load", [talk.prepared().preparing, None if data is None else data.decode("latin-1")])

    def on_save(self, talk, text):
        talk.prepared().save(text.encode("latin-1"))

    def on_step(self, talk, pose):
        log("step", shown(talk.step(pose)))

    def on_recommend(self, talk, pose):
        talk.recommend(pose)


if __name__ == "__main__":
    serve(ServiceUser)
