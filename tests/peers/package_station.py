"""The authors' LensEnv as a station: its own lenses, stage and renderer, driven by relign-bench and its agents.

The file `log` gets its ground truth, one line per capture: pose and elements in the terms of relign-bench.
"""

import json

import package_images

from relign_bench.plugin import Moved, Station, parameter, serve

SAMPLES = 64


class PackageStation(Station):
    id = "package-station"
    reproducible = "this_cpu"
    license = "Apache-2.0"

    level = parameter(0.25, minimum=0, maximum=1, description="The package's share of noise on the elements")
    log = parameter("", description="File for pose and elements, one line per capture")

    environment = None
    trials = 0

    def describe(self):
        axes = [{"name": name, "unit": "mm", "lower": -1, "upper": 1} for name in ("x", "y", "z")]
        axes += [{"name": name, "unit": "deg", "lower": -7, "upper": 7} for name in ("Rx", "Ry")]
        width = package_images.WIDTH
        return {"name": "LensEnv", "axes": axes, "image": {"width": width, "height": width, "white": 0.115}}

    def reference(self):
        return package_images.shipped_reference()

    def begin(self, seed):
        self.environment = package_images.make_environment("siemens", SAMPLES, self.level, seed % 2**31)
        self.image = self.environment.reset()
        self.elements = package_images.our_elements(self.environment)
        self.trials, self.steps = self.trials + 1, 0

    def move_by(self, delta):
        # The package's angles are left-handed.
        package = [share if axis < 3 else -share for axis, share in enumerate(delta)]
        self.image = self.environment.step(package)["img"]
        self.steps += 1
        limits = [1 if share >= 1 else -1 if share <= 0 else 0 for share in package_images.our_pose(self.environment.r)]
        return Moved(delta, 0.1, limits)

    def capture(self):
        if self.log:
            line = {"trial": self.trials, "step": self.steps, "pose": package_images.our_pose(self.environment.r),
                    "elements": self.elements}
            with open(self.log, "a") as out:
                out.write(json.dumps(line) + "\n")
        return self.image[..., 0].astype("float32"), 0.05


if __name__ == "__main__":
    serve(PackageStation)
