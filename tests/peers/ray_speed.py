"""Rays through the same lens by relign-bench, batoid, Optiland and ray-optics on one core: `python ray_speed.py`.

The lens and the 256 rays are those of relign-bench-perf's `trace_block`: relign_od with two elements off, from one point of
the sensor. First all programs' intersections are compared with those of `relign-bench lens trace`. Then the programs are
timed in turn, in processor time, several rounds; a ratio is the median of the rounds' ratios.
"""

import argparse
import importlib.metadata
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
import warnings
from dataclasses import dataclass, field, replace
from pathlib import Path

# Libraries read these when they are imported.
for threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ[threads] = "1"

import numpy as np  # noqa: E402
import program  # noqa: E402
from placed_lens import placed_faces, turn  # noqa: E402

# As in benchmarks/imaging_perf.cpp.
ELEMENTS = {
    "L3": {"shift_mm": [0.0002, -0.0001, 0.0001], "tilt_deg": [0.4, -0.3]},
    "L4": {"shift_mm": [-0.0001, 0.0002, 0.0001], "tilt_deg": [-0.5, 0.2]},
}
POSE = (0.52, 0.49, 0.5, 0.53, 0.48)
ON_SENSOR_MM = (0.3, 0.2)
BLOCK = 256
FACES = 8
IN_FRONT_MM = 1.0  # rays start this far in front of the first vertex
# Rays per call: the peers' fastest is taken.
CALLS = (256, 4096, 16384, 65536)
RAYS_ONE_BY_ONE = 32  # of ray-optics, which traces single rays


@dataclass
class Competitor:
    program: str
    package: str
    precision: str
    module: str = ""
    backend: str = ""  # Optiland's
    surfaces: int = FACES
    rays: int = 0  # per call
    difference_mm: float = None
    rates: list = field(default_factory=list)  # ray-surfaces per second, by round


PEERS = [
    Competitor("batoid", "batoid", "double", "batoid_lens"),
    Competitor("Optiland, NumPy", "optiland", "double", "optiland_lens", "numpy"),
    Competitor("Optiland, torch", "optiland", "double", "optiland_lens", "torch"),
    Competitor("Optiland, torch", "optiland", "float", "optiland_lens", "torch"),
    # Its trace always ends on the image plane.
    Competitor("ray-optics", "rayoptics", "double", "rayoptics_lens", surfaces=FACES + 1),
]


def scene():
    return json.loads((program.LENS_FILE.parent / "scene.json").read_text())


def sensor_point(scene):
    """The point of the sensor and the rotation from lens to world, for the pose; all in lens coordinates."""
    shares = 2 * np.array(POSE) - 1
    tilts = shares[3:] * scene["travel"]["tilt_deg"]
    rotation = turn(0, tilts[0]) @ turn(1, tilts[1])
    shift = shares[:3] * scene["travel"]["shift_mm"]
    point = rotation.T @ (np.array([*ON_SENSOR_MM, scene["sensor"]["z_mm"]]) - shift)
    return point + [0, 0, scene["pivot_behind_first_vertex_mm"]], rotation


def refracted_backwards(face, index_before, points, directions):
    """Rays from behind a spherical face, in front of it."""
    p, d = (points - face.vertex_mm) @ face.rotation, directions @ face.rotation
    p = p - p[:, 2:] / d[:, 2:] * d
    c, pp = 1 / face.radius_mm, (p * p).sum(axis=1)
    b = d[:, 2] - c * (p * d).sum(axis=1)
    p = p + (c * pp / (b - np.sqrt(b * b - c * c * pp)))[:, None] * d
    normal = c * p - [0, 0, 1]  # unit, along the rays
    ratio, cosine = face.index_after / index_before, (normal * d).sum(axis=1)
    bent = np.sqrt(1 - ratio**2 * (1 - cosine**2)) - ratio * cosine
    d = ratio * d + bent[:, None] * normal
    return p @ face.rotation.T + face.vertex_mm, d @ face.rotation.T


def rays_of_block(lens, scene):
    """Starts in front of the lens and directions towards it (lens coordinates) of the rays of trace_block, reversed."""
    point, lens_to_world = sensor_point(scene)
    i = np.arange(BLOCK)
    towards = np.stack([0.2 * (i % 16 - 7.5) / 8, 0.2 * (i // 16 - 7.5) / 8, -np.ones(BLOCK)], axis=1)
    d = towards / np.linalg.norm(towards, axis=1)[:, None] @ lens_to_world
    p = np.tile(point, (BLOCK, 1))
    faces = placed_faces(lens, ELEMENTS)
    for number in reversed(range(len(faces))):
        p, d = refracted_backwards(faces[number], faces[number - 1].index_after if number else 1.0, p, d)
    return p - (p[:, 2:] + IN_FRONT_MM) / d[:, 2:] * d, -d


def our_hits(starts, directions):
    rays = [{"start_mm": list(s), "direction": list(d), "elements": ELEMENTS} for s, d in zip(starts, directions)]
    with tempfile.TemporaryDirectory() as folder:
        traced = program.trace(rays, folder)
    lost = sum("lost_at" in ray for ray in traced)
    if lost:
        raise RuntimeError(f"relign-bench lens trace lost {lost} of {len(traced)} rays of the block")
    return np.array([ray["hits_mm"] + [ray["image_mm"]] for ray in traced])


def missed_sensor_point_mm(hits, point):
    """How far the traced rays pass the point of the sensor at which the rays of trace_block start."""
    d = hits[:, -1] - hits[:, -2]
    d /= np.linalg.norm(d, axis=1)[:, None]
    return np.linalg.norm(np.cross(point - hits[:, -1], d), axis=1).max()


def module_of(peer):
    if peer.backend:
        import optiland.backend

        optiland.backend.set_backend(peer.backend)
        if peer.backend == "torch":
            import torch

            torch.set_num_threads(1)
            optiland.backend.set_precision("float32" if peer.precision == "float" else "float64")
    return importlib.import_module(peer.module)


def hits_of(peer, lens, starts, directions):
    return module_of(peer).hits(lens, ELEMENTS, starts, directions)


def missing_package(peer):
    needed = [peer.package] + (["torch"] if peer.backend == "torch" else [])
    return next((package for package in needed if not importlib.util.find_spec(package)), None)


def seconds_per_call(work, at_least):
    """Processor time of one call, from as many calls as take `at_least` seconds."""
    calls, start = 0, time.process_time()
    while True:
        work()
        calls += 1
        taken = time.process_time() - start
        if taken >= at_least:
            return taken / calls


class Runner:
    """Calls of one peer with its fastest number of rays per call."""

    def __init__(self, peer, lens, starts, directions, at_least):
        self.peer, self.at_least = peer, at_least
        module = module_of(peer)
        best = 0
        for rays in (RAYS_ONE_BY_ONE,) if peer.package == "rayoptics" else CALLS:
            which = np.arange(rays) % BLOCK
            work = module.pass_through_faces(lens, ELEMENTS, starts[which], directions[which])
            work()
            rate = rays / seconds_per_call(work, at_least / 4)
            if rate > best:
                best, peer.rays, self.work = rate, rays, work

    def measure(self):
        module_of(self.peer)
        rate = self.peer.rays * self.peer.surfaces / seconds_per_call(self.work, self.at_least)
        self.peer.rates.append(rate)


class Ours:
    """relign-bench-perf, which copies a block of rays and traces it, again and again."""

    def __init__(self, at_least):
        self.at_least = at_least
        # The peers only refract; images need transmittance, too.
        self.refract, self.fresnel = (
            Competitor(f"relign-bench, {what}", "", "float", rays=BLOCK) for what in ("refraction", "with transmittance")
        )

    def measure(self):
        options = ("--benchmark_filter=^trace_block/", f"--benchmark_min_time={self.at_least}", "--benchmark_format=json")
        done = subprocess.run([perf_path(), *options], capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"relign-bench-perf failed with exit code {done.returncode}: {done.stderr.strip()}")
        found = json.loads(done.stdout)["benchmarks"]
        for competitor, kind in ((self.refract, "refract"), (self.fresnel, "fresnel")):
            times = [b["cpu_time"] for b in found if b["name"].endswith(kind) and "error_occurred" not in b]
            if not times:
                raise RuntimeError("relign-bench-perf timed no trace_block, which needs a processor with AVX2")
            competitor.rates.append(BLOCK * FACES / (min(times) * 1e-9))


def version_of(competitor):
    if not competitor.package:
        return program.call("--version").split()[1]
    return importlib.metadata.version(competitor.package)


def compare(rounds, at_least, say=lambda _: None):
    """The result as a dictionary for JSON."""
    lens, setup = program.lens(), scene()
    starts, directions = rays_of_block(lens, setup)
    expected = our_hits(starts, directions)
    result = {"lens": "relign_od", "missing": [], "load_average": [os.getloadavg()[0]], "cores": os.cpu_count()}
    result["missed_sensor_point_mm"] = missed_sensor_point_mm(expected, sensor_point(setup)[0])
    ours, runners = Ours(at_least), []
    for known in PEERS:
        missing = missing_package(known)
        if missing:
            result["missing"].append(f"{known.program}, {known.precision}: {missing} is not installed")
            continue
        peer = replace(known, rates=[])
        found = hits_of(peer, lens, starts, directions)
        peer.difference_mm = float(np.linalg.norm(found - expected, axis=2).max())
        say(f"{peer.program}, {peer.precision}: {BLOCK} rays agree to {peer.difference_mm:.1e} mm")
        runners.append(Runner(peer, lens, starts, directions, at_least))
    for number in range(rounds):
        say(f"round {number + 1} of {rounds}")
        for each in (ours, *runners):
            each.measure()
    result["load_average"].append(os.getloadavg()[0])
    competitors = [ours.refract, ours.fresnel] + [runner.peer for runner in runners]
    result["programs"] = [row(competitor, ours.refract) for competitor in competitors]
    return result


def row(competitor, reference):
    rate = statistics.median(competitor.rates)
    return {
        "program": competitor.program,
        "version": version_of(competitor),
        "precision": competitor.precision,
        "rays": competitor.rays,
        "surfaces": competitor.surfaces,
        "seconds": competitor.rays * competitor.surfaces / rate,
        "million_ray_surfaces_per_second": rate / 1e6,
        "by_round": [each / 1e6 for each in competitor.rates],
        "ours_is_faster_by": statistics.median(a / b for a, b in zip(reference.rates, competitor.rates)),
        "largest_difference_mm": competitor.difference_mm,
    }


def table(result):
    heads = "program, version, precision, lens, rays per call, surfaces, time, million ray-surfaces/s (rounds), "
    heads += "ours is faster by, largest difference"
    lines = ["| " + heads.replace(", ", " | ") + " |", "|---" * len(heads.split(", ")) + "|"]
    for each in result["programs"]:
        rates = each["by_round"]
        difference = each["largest_difference_mm"]
        cells = (
            each["program"],
            each["version"],
            each["precision"],
            result["lens"],
            each["rays"],
            each["surfaces"],
            f"{each['seconds'] * 1e6:.3g} us",
            f"{each['million_ray_surfaces_per_second']:.3g} ({min(rates):.3g} to {max(rates):.3g})",
            f"{each['ours_is_faster_by']:.3g}",
            "-" if difference is None else f"{difference:.1e} mm",
        )
        lines.append("| " + " | ".join(map(str, cells)) + " |")
    return "\n".join(lines)


def perf_path():
    return program.path().parent / "relign-bench-perf"


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=0.5, help="processor time per program and round")
    parser.add_argument("-o", "--output", type=Path, help="also write the result as JSON")
    options = parser.parse_args()
    if program.path() is None or not perf_path().is_file():
        sys.exit("ray_speed.py: relign-bench-perf is not built beside relign-bench; ./quickstart peers builds both")
    # Of Numba, which Optiland uses, about its internals.
    warnings.filterwarnings("ignore", module="numba|optiland")
    result = compare(options.rounds, options.seconds, lambda line: print(line, file=sys.stderr))
    print(table(result))
    low, high = sorted(result["load_average"])
    print("relign-bench traces the rays from the sensor, with stops and rims; the others the same rays forwards, without them")
    print("not measured: relign-bench, double: relign-bench-perf has no block of rays in double")
    print(f"rays: return to their point of the sensor within {result['missed_sensor_point_mm']:.1e} mm (lens trace)")
    print(f"processor time, one thread; {result['cores']} cores, load average {low:.1f} to {high:.1f}")
    for line in result["missing"]:
        print(f"not measured: {line} (./quickstart peers installs it)")
    if options.output:
        options.output.parent.mkdir(parents=True, exist_ok=True)
        options.output.write_text(json.dumps(result, indent=2) + "\n")


if __name__ == "__main__":
    main()
