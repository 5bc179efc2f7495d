"""An agent of blop, as its package has it, aligns the layout's lens. See README.md."""
from blop.ax import Agent, Objective, RangeDOF
from bluesky_align import arguments, devices, run


class Errors:
    """Collects a reading by run from the documents, and gives blop the value of each suggestion."""

    def __init__(self, key):
        self.key, self.order, self.runs, self.values = key, {}, {}, {}

    def collect(self, name, document):
        """A callback for the RunEngine."""
        if name == "start":
            self.order[document["uid"]], self.values[document["uid"]] = document.get("blop_acquisition_order", []), []
        elif name == "descriptor":
            self.runs[document["uid"]] = document["run_start"]
        elif name == "event" and self.key in document["data"]:
            self.values[self.runs[document["descriptor"]]].append(document["data"][self.key])

    def __call__(self, uid, suggestions):
        return [{"_id": number, "error": value} for number, value in zip(self.order[uid], self.values[uid])]


def main():
    options = arguments("Align the layout's lens with an agent of blop.").parse_args()
    motors, camera, box = devices(options)
    errors = Errors(camera.error.name)
    agent = Agent(
        sensors=[camera], dofs=[RangeDOF(actuator=motor, bounds=box[motor.name], parameter_type="float") for motor in motors],
        objectives=[Objective(name="error", minimize=True)], evaluation_function=errors)
    run(agent.optimize(options.steps), errors.collect)
    run(agent.navigate_to_best())
    _, pose, measured = agent.get_best_points()[0]
    error = measured["error"][0] if isinstance(measured["error"], tuple) else measured["error"]
    print(f"best: {error:.6f} at", ", ".join(f"{name} {value:.4f}" for name, value in pose.items()))


if __name__ == "__main__":
    main()
