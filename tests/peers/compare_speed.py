"""Time per image of the paper's package and of relign-bench: `python compare_speed.py`. Not a test; needs an idle machine.

The package: one step of its environment. relign-bench: one process of `relign-bench render` with its start, and one more step
of a running trial, which has a capture and the noise-free error of the true pose.
"""

import os
import statistics
import tempfile
import time

import package_images
import program

IMAGES = 5
STEPS = (10, 60)


def seconds(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


def package_seconds():
    environment = package_images.make_environment("siemens", 64, 0, 1)
    environment.reset()
    return statistics.median(seconds(lambda: environment.step([0.01] * 5)) for _ in range(IMAGES))


def process_seconds(scene):
    with tempfile.TemporaryDirectory() as folder:
        target = package_images.pattern_file("siemens")

        def work():
            program.render(folder, [0.5] * 5, {}, target, scene, "--seed", "1")

        work()  # the first call fills the user's cache
        return statistics.median(seconds(work) for _ in range(IMAGES))


def step_seconds():
    def trial(steps):
        call = ("try", "random", "--noise-level", "rho0", "--progress", "none", "--steps", steps)
        return seconds(lambda: program.call(*call))

    trial(STEPS[0])
    return (trial(STEPS[1]) - trial(STEPS[0])) / (STEPS[1] - STEPS[0])


def main():
    rows = [("relign_od, relign-bench render, whole process", process_seconds("relign_od"))]
    if program.has_scene("relign_od-package"):
        rows.append(("relign_od-package (ghosts), the same", process_seconds("relign_od-package")))
    rows.append(("relign_od, one more step of a trial, with ground truth", step_seconds()))
    package = package_seconds()
    print(f"seconds per image of 200 x 200; {os.cpu_count()} cores, load average {os.getloadavg()[0]:.1f}")
    print(f"{'package, one step of LensEnv, 64 samples':50s} {package:8.3f} s")
    for name, value in rows:
        print(f"{name:50s} {value:8.3f} s, {package / value:6.1f} times as fast")


if __name__ == "__main__":
    main()
