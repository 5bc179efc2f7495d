"""Runs one lens file of a corpus through import, first-order values, rays and images: one row of corpus.py."""

import json
import math
import os
import re
import resource
import signal
import subprocess
import tempfile
import time
from pathlib import Path

import numpy as np
import sequential_rays
import zemax_file
from corpus_image_checks import Profile, look_at_image

# Limits of `scene new`. The hard limits protect the machine and still let an excess be measured.
TIME_LIMIT_S = 20
MEMORY_LIMIT_MB = 500
HARD_TIME_S = 90
HARD_MEMORY_MB = 6000
# `scene new` refuses a file within 0.2 s, before it renders.
REFUSAL_CPU_S = 2
STAGES = ("refusals", "import", "images")
# Two paraxial ray traces in double differ by rounding; the import rounds radii to 13 digits and positions to 1e-10 mm.
FIRST_ORDER_ALLOWED = 1e-6
# The index of a catalogue glass is the one that `lens info` prints, with 6 decimals.
PRINTED_INDEX_ALLOWED = 2e-5
# Image points of single rays: the same, relative to the image height; steep aspheres amplify the rounding of positions.
IMAGE_POINT_ALLOWED = 1e-6
# Noise-free images and exact rays: 0.2 % on correct lenses (docs/validation.md); 2 % detects every relevant fault.
IRRADIANCE_ALLOWED = 0.02
# Relative to the brightest place, where nearly everything is vignetted.
IRRADIANCE_FLOOR = 0.002
STANDARD_ERRORS = 3
FIELD_PLACES = (0.0, 0.3, 0.5, 0.7, 0.85, 0.97)  # of the image height
MARGIN_OF_SENSOR = 1.3  # `scene new` makes the sensor 1.3 times the image circle (docs/lens_files.md)

COLUMNS = ("file", "verdict", "kind", "reason", "failed", "notes", "seconds", "cpu_seconds", "memory_mb", "capture_seconds",
           "faces", "aspheres", "f_number", "half_field_deg", "focal_length_mm", "first_order_error", "image_point_error",
           "asymmetry", "ring_error", "missing_pixels", "irradiance_error", "irradiance_places", "stage", "program")


class Outcome:
    """A child process with its output, times and peak memory."""

    def __init__(self, command, environment, folder, cpu_limit_s=None):
        with tempfile.TemporaryFile(dir=folder) as out, tempfile.TemporaryFile(dir=folder) as error:
            begin = time.monotonic()
            child = subprocess.Popen(command, stdout=out, stderr=error, env=environment,
                                     preexec_fn=lambda: set_limits(cpu_limit_s))  # noqa: PLW1509 (this process has no threads)
            status, usage = wait(child.pid, begin + HARD_TIME_S)
            child.returncode = os.waitstatus_to_exitcode(status)
            self.seconds = time.monotonic() - begin
            out.seek(0)
            error.seek(0)
            self.out = out.read().decode("utf-8", "replace")
            self.error = error.read().decode("utf-8", "replace")
        self.code = child.returncode
        self.cpu_seconds = usage.ru_utime + usage.ru_stime
        self.memory_mb = usage.ru_maxrss / 1024

    def died(self):
        return self.code < 0 or self.code not in (0, 2, 5)


def set_limits(cpu_limit_s):
    if cpu_limit_s:
        resource.setrlimit(resource.RLIMIT_CPU, (cpu_limit_s, cpu_limit_s + 2))
    size = HARD_MEMORY_MB * 2**20
    resource.setrlimit(resource.RLIMIT_AS, (size, size))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def wait(pid, deadline):
    while True:
        found, status, usage = os.wait4(pid, os.WNOHANG)
        if found:
            return status, usage
        if time.monotonic() > deadline:
            os.kill(pid, signal.SIGKILL)
            _, status, usage = os.wait4(pid, 0)
            return status, usage
        time.sleep(0.005)


class Row(dict):
    def __init__(self, file, program):
        super().__init__(dict.fromkeys(COLUMNS, ""))
        self["file"], self["program"], self["stage"] = file, program, STAGES[0]
        self.failures, self.notes = [], []

    def fail(self, check, what):
        self.failures.append(f"{check}: {what}")

    def close(self):
        if not self["verdict"]:
            self["verdict"] = "wrong" if self.failures else "right"
        self["failed"] = "; ".join(self.failures)
        self["notes"] = "; ".join(self.notes)
        return dict(self)


def kind_of(reason):
    """A reason without position, names and numbers, which differ between files."""
    text = re.sub(r"^error: ", "", reason)
    text = re.sub(r"^.*?\.(zmx|seq|lis|json)(:\d+)*:? ?(as lens\.json)?:? ?", "", text, flags=re.IGNORECASE)
    text = re.sub(r"/[a-z_]+(/\d+)?(/[a-z_]+/\d+)?(/[a-z_]+)?: ", "", text)
    text = re.sub(r"(?<!of type )'[^']*'", "'...'", text)
    text = re.sub(r"\b(surface|surfaces|of) (STO|L?\d+)\b", r"\1 N", text)
    text = re.sub(r"\bL\d+\b", "L", text)
    text = re.sub(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", "N", text)
    return text.split(";")[0].strip()[:160]


def strange_numbers(text):
    return re.findall(r"(?<![\w.'/-])[-+]?(?:nan|inf(?:inity)?)(?![\w'])", text, flags=re.IGNORECASE)


class Examination:
    def __init__(self, file, name, program, program_hash, work, stage):
        self.file, self.program, self.work, self.stage = file, program, work, stage
        self.row = Row(name, program_hash)
        self.environment = {**os.environ, "XDG_CACHE_HOME": str(work / "cache")}

    def call(self, *arguments):
        return Outcome([str(self.program), *map(str, arguments)], self.environment, self.work)

    def run(self):
        try:
            self.examine()
        except Exception as error:  # a fault of this script is reported and does not end the run
            place = error.__traceback__
            while place.tb_next:
                place = place.tb_next
            where = f"{Path(place.tb_frame.f_code.co_filename).name}:{place.tb_lineno}"
            self.row["verdict"] = "script error"
            self.row["reason"] = f"{type(error).__name__} at {where}: {error}"
        return self.row.close()

    def examine(self):
        self.design = self.read_design()
        info = self.call("lens", "info", self.file, "--json")
        if self.refused("lens info", info):
            return
        if self.stage == "refusals":
            self.ask_for_refusal()
            return
        self.row["stage"] = self.stage
        made = self.call("--json", "scene", "new", self.file, "-o", self.work / "scene")
        self.measure(made)
        if self.refused("scene new", made):
            return
        self.lens_json = json.loads((self.work / "scene/lens.json").read_text())
        self.scene = json.loads((self.work / "scene/scene.json").read_text())
        self.check_numbers(json.loads(info.out), [info.out, made.out])
        self.check_image_points()
        if self.stage == "images":
            self.check_image()

    def ask_for_refusal(self):
        """Starts `scene new` and stops it where it would render."""
        command = [str(self.program), "scene", "new", str(self.file), "-o", str(self.work / "scene")]
        made = Outcome(command, self.environment, self.work, REFUSAL_CPU_S)
        if made.code == -signal.SIGXCPU or not self.refused("scene new", made):
            self.row["verdict"] = "accepted"

    def read_design(self):
        """The file by this package's own reader; None where only the program can read it."""
        if self.file.suffix.lower() != ".zmx":
            return None
        try:
            design = zemax_file.read(self.file)
            self.row["faces"], self.row["aspheres"] = zemax_file.counts(design)
            return design
        except (ValueError, IndexError, KeyError) as error:
            self.row.notes.append(f"own reader: {type(error).__name__} {error}")
            return None

    def refused(self, verb, outcome):
        if outcome.code == 0:
            return False
        lines = [line for line in outcome.error.splitlines() if line.strip() and not line.startswith("warning: ")]
        reason = lines[0] if lines else ""
        self.row["reason"] = reason[:400].replace(str(self.file), self.file.name)
        if "out of memory" in outcome.error:
            self.row["verdict"] = "wrong"
            self.row.fail("memory", f"{verb} needs more than {HARD_MEMORY_MB} MB (limit of this script)")
            return True
        if outcome.died():
            self.row["verdict"] = "wrong"
            over = " (limit of this script)" if outcome.seconds >= HARD_TIME_S else ""
            self.row.fail("crash", f"{verb} ended with {outcome.code} after {outcome.seconds:.0f} s{over}")
            return True
        self.row["verdict"] = "refused"
        self.row["kind"] = kind_of(reason)
        others = sorted({kind_of(line) for line in lines} - {self.row["kind"], "", "nothing was written"})
        if others:
            self.row.notes.append("also: " + " | ".join(others))
        return True

    def measure(self, made):
        row = self.row
        row["seconds"], row["cpu_seconds"] = f"{made.seconds:.2f}", f"{made.cpu_seconds:.2f}"
        row["memory_mb"] = f"{made.memory_mb:.0f}"
        # On a shared machine, wall time includes other work.
        if min(made.seconds, made.cpu_seconds) > TIME_LIMIT_S:
            row.fail("time", f"scene new took {made.seconds:.1f} s, {made.cpu_seconds:.1f} s of processor time")
        if made.memory_mb > MEMORY_LIMIT_MB:
            row.fail("memory", f"scene new took {made.memory_mb:.0f} MB")

    # First order -----------------------------------------------------------------------------------------------------

    def check_numbers(self, info, texts):
        row, found = self.row, info["first_order"]
        printed = self.call("lens", "info", self.file)
        for name, text in [("lens info --json", texts[0]), ("scene new", texts[1]), ("lens info", printed.out)]:
            if strange_numbers(text):
                row.fail("numbers", f"{name} prints {strange_numbers(text)[0]}")
        empty = [name for name, value in found.items() if value is None]
        if empty:
            row.fail("numbers", f"null: {', '.join(empty)}")
            return
        for file in (self.work / "scene").iterdir():
            if strange_numbers(file.read_text(errors="replace")):
                row.fail("numbers", f"{file.name} has {strange_numbers(file.read_text(errors='replace'))[0]}")
        rows = re.finditer(r"^L\d+ (?:front|inner|back)\s+\S+\s+\S+\s+(\S+)", printed.out, re.MULTILINE)
        self.printed_indices = [float(match[1]) for match in rows]
        self.lens = sequential_rays.from_lens_json(self.lens_json, self.printed_indices)
        indices = [face.index_after for face in self.lens.faces]
        named = [face.get("glass_after") for element in self.lens_json["elements"] for face in element["faces"]]
        own = self.lens_json.get("glasses", {})
        from_print = any(name and "nd" not in own.get(name, {}) for name in named)
        self.tolerance = PRINTED_INDEX_ALLOWED if from_print else FIRST_ORDER_ALLOWED
        if from_print:
            row.notes.append("indices of catalogue glasses as lens info prints them")
        row["focal_length_mm"] = f"{found['focal_length']:.6g}"
        row["f_number"] = f"{found['f_number']:.4g}"
        row["half_field_deg"] = f"{info['half_field_deg']:.5g}"
        row["faces"] = len(self.lens.faces)
        row["aspheres"] = sum(
            1
            for element in self.lens_json["elements"]
            for face in element["faces"]
            if set(face) & {"conic", "even_asphere", "odd_asphere", "r2", "q_bfs", "q_con"}
        )
        self.own_first_order(indices)
        expected = self.first
        deviations = {}
        for name in ("focal_length", "back_focal_length", "f_number"):
            ours = getattr(expected, name)
            if not math.isnan(ours):
                deviations[name] = relative(found[name], ours, found["focal_length"] if "back" in name else ours)
        opening = self.first.pupil_per_stop * 2 * self.aperture()["opening_radius_mm"]
        if not math.isnan(expected.f_number) and math.isfinite(opening) and "on_face" not in self.aperture():
            deviations["opening of the stop"] = relative(found["focal_length"] / opening, expected.f_number)
        half_field = zemax_file.half_field_deg(self.design, expected) if self.followed() else math.nan
        if half_field > info["half_field_deg"] * 1.005:
            # `scene new` prints a remark: beyond it no chief ray passes, or the target would be infinite.
            row.notes.append(f"half field {info['half_field_deg']:.4g} of {half_field:.4g} degrees")
        elif half_field > 0:
            deviations["half field"] = relative(info["half_field_deg"], half_field)
        elif self.followed():
            row.notes.append("half field not checked")
        row["first_order_error"] = f"{max(deviations.values()):.1e}"
        for name, deviation in deviations.items():
            # half_field_deg has 6 decimals, the opening 9.
            allowed = max(self.tolerance, 1e-6 if name == "half field" else 0)
            if not deviation <= allowed:
                row.fail("first order", f"{name} off by {deviation:.1e}")
        if "f_number_of_opening" in found:
            opened = found["f_number_of_opening"]
            row.fail("first order", f"f_number_of_opening {opened:.4g} beside {found['f_number']:.4g}")

    def aperture(self):
        return next(stop for stop in self.lens_json["stops"] if stop.get("aperture"))

    def followed(self):
        """Whether the reference values come from the file itself."""
        return self.design is not None and not self.design.unread

    def own_first_order(self, indices):
        """First-order values from the file's own text where the reader understands it, else from lens.json."""
        design = self.design
        if self.followed():
            rows, stop, image_z = zemax_file.faces(design, design.wavelength_um)
            if len(rows) == len(indices):
                # Model glasses by the program's documented convention, catalogue glasses by its printed index.
                ours = [behind if isinstance(behind, float) else index for (_, _, behind), index in zip(rows, indices)]
                self.indices = ours
                self.first = zemax_file.first_order(design, ours)
                return
            self.row.fail("first order", f"{len(indices)} faces, we read {len(rows)}")
        self.row.notes.append("first order and rays from lens.json, not from the file")
        self.design = None
        design = zemax_file.Design([zemax_file.Surface(thickness=math.inf)])
        faces = self.lens.faces
        for face, following in zip(faces, [face.z for face in faces[1:]] + [self.lens.image_z]):
            surface = zemax_file.Surface(curvature=face.curvature, thickness=following - face.z)
            r2 = face.even[1] if face.even is not None else 0.0
            surface.even = {2: r2} if r2 else {}
            surface.glass = f"index {face.index_after}" if face.index_after != 1 else ""
            design.surfaces.append(surface)
        design.surfaces.append(zemax_file.Surface())
        self.first = zemax_file.first_order(design, indices)
        stop = self.aperture()
        trial = sequential_rays.from_lens_json(self.lens_json, self.printed_indices).stops
        gap = next((s.gap for s, told in zip(trial, self.lens_json["stops"]) if told is stop), -1)
        if gap >= 0:
            self.first = with_stop(faces, indices, gap, stop["z_mm"], self.first)

    # Single rays -----------------------------------------------------------------------------------------------------

    def check_image_points(self):
        """Compares chief rays of the field and two axial rays on the design's image plane."""
        row, half_field = self.row, self.lens_json["half_field_deg"]
        if row.failures and any("null" in failure or "faces, we read" in failure for failure in row.failures):
            return
        if any("placement" in element for element in self.lens_json["elements"]):
            row.notes.append("rays and images not checked: decentred elements")
            return
        lens = self.lens_of_file()
        pupil_z, radius = self.first.entrance_pupil_z, abs(self.first.focal_length) / float(row["f_number"]) / 2
        if not (math.isfinite(pupil_z) and half_field > 0):
            row.notes.append("chief ray not checked")
            return
        rays, names = [], []
        for share in (1.0, 0.7, 0.4):
            slope = math.tan(math.radians(share * half_field))
            rays.append({"start_mm": [0, -(pupil_z + 1) * slope, -1], "direction": [0, slope, 1]})
            names.append(f"chief ray at {share:g} of the field")
        for share in (0.5, 0.9):
            rays.append({"start_mm": [0, share * radius, -1], "direction": [0, 0, 1]})
            names.append(f"ray at {share:g} of the pupil")
        file = self.work / "rays.json"
        file.write_text(json.dumps({"rays": rays}))
        traced = self.call("lens", "trace", file, "--scene", self.work / "scene/scene.json")
        if traced.code != 0:
            row.fail("rays", f"lens trace: {traced.error.splitlines()[0] if traced.error else traced.code}")
            return
        found = [ray.get("image_mm") for ray in json.loads(traced.out)["rays"]]
        ours = sequential_rays.image_points(
            lens, [ray["start_mm"] for ray in rays], [ray["direction"] for ray in rays], lens.image_z
        )
        height = abs(self.first.focal_length) * math.tan(math.radians(half_field))
        errors = []
        for name, theirs, point in zip(names, found, ours):
            if np.isnan(point).any():
                row.notes.append(f"{name}: outside the clear radii, not compared")
            elif theirs is None:
                row.fail("rays", f"{name} is lost, ours passes")
            else:
                errors.append(float(np.hypot(theirs[0] - point[0], theirs[1] - point[1])) / height)
                if not errors[-1] <= max(self.tolerance, IMAGE_POINT_ALLOWED):
                    row.fail("rays", f"{name} off by {errors[-1]:.1e} of the image height")
        if errors:
            row["image_point_error"] = f"{max(errors):.1e}"

    def lens_of_file(self):
        """Shapes and positions of the file, with semi-diameters and stop of lens.json."""
        if not self.followed():
            return self.lens
        rows, _, image_z = zemax_file.faces(self.design, self.design.wavelength_um)
        faces = []
        for (surface, z, _), index, made in zip(rows, self.indices, self.lens.faces):
            even = np.zeros(1 + max(surface.even, default=0) // 2)
            for power, value in surface.even.items():
                even[power // 2] = value
            faces.append(
                sequential_rays.Face(
                    z, surface.curvature, surface.conic, made.clear_radius, index, even if surface.even else None
                )
            )
        image_z = image_z if image_z > rows[-1][1] + 1e-9 else self.lens.image_z
        if abs(image_z - self.lens.image_z) > 1e-6:
            self.row.fail("first order", f"image plane at {self.lens.image_z:.6f} mm, the file has {image_z:.6f}")
            image_z = self.lens.image_z
        return sequential_rays.Lens(faces, self.lens.stops, None, image_z)

    # Images ----------------------------------------------------------------------------------------------------------

    def check_image(self):
        row, scene = self.row, self.scene
        # So wide that its border is outside the image.
        distance = abs(scene["emitter"]["z_mm"])
        scene["emitter"].update(side_mm=min(20 * distance, 1e7), target="white", texels=2)
        file = self.work / "scene/white.json"
        file.write_text(json.dumps(scene))
        capture = self.call("render", "--scene", file, "--pose", "nominal", "-o", self.work / "capture.npy")
        row["capture_seconds"] = f"{capture.seconds:.2f}"
        image = self.call("render", "--scene", file, "--pose", "nominal", "--noise-free", "-o", self.work / "image.npy")
        for outcome in (capture, image):
            if outcome.code != 0:
                row.fail("image", f"render: {outcome.error.splitlines()[0] if outcome.error else outcome.code}")
                return
        pixels = np.load(self.work / "image.npy").astype(float).squeeze()
        look_at_image(pixels, row)
        if any("placement" in element for element in self.lens_json["elements"]):
            return
        self.check_irradiance(pixels)

    def check_irradiance(self, pixels):
        row, scene = self.row, self.scene
        pitch = scene["sensor"]["side_mm"] / pixels.shape[0]
        image_height = scene["sensor"]["side_mm"] / 2 / MARGIN_OF_SENSOR / pitch
        pivot = scene["pivot_behind_first_vertex_mm"]
        profile = Profile(pixels)
        brightest = max(profile.means[: int(image_height)].max(), 1e-12)
        errors, exact_places = [], []
        for share in FIELD_PLACES:
            place = share * image_height
            exact, deviation = sequential_rays.irradiance(
                self.lens,
                place * pitch,
                scene["sensor"]["z_mm"] + pivot,
                scene["emitter"]["z_mm"] + pivot,
                scene["emitter"]["side_mm"] / 2,
            )
            found, noise, bend = profile.at(place)
            uncertain = STANDARD_ERRORS * math.hypot(deviation, noise) + bend
            scale = max(exact, IRRADIANCE_FLOOR / IRRADIANCE_ALLOWED * brightest)
            errors.append((found - exact) / scale)
            exact_places.append(f"{found:.4g}/{exact:.4g}")
            if abs(found - exact) > IRRADIANCE_ALLOWED * scale + uncertain:
                row.fail("irradiance", f"{100 * errors[-1]:+.1f} % at {share:g} of the image height")
        row["irradiance_error"] = f"{max(errors, key=abs):+.4f}"
        row["irradiance_places"] = " ".join(exact_places)


def relative(found, expected, scale=None):
    return abs(found - expected) / abs(expected if scale is None else scale)


def with_stop(faces, indices, gap, stop_z, first):
    """The entrance pupil of a stop before face `gap`, for lenses from lens.json."""

    def at_stop(y, nu):
        at, before = 0.0, 1.0
        for face, behind in zip(faces[:gap], indices):
            r2 = face.even[1] if face.even is not None else 0.0
            y += nu / before * (face.z - at)
            nu -= y * (behind - before) * (face.curvature + 2 * r2)
            at, before = face.z, behind
        return y + nu / before * (stop_z - at)

    a, b = at_stop(1.0, 0.0), at_stop(0.0, 1.0)
    return zemax_file.FirstOrder(first.focal_length, first.back_focal_length, b / a, abs(1 / a), first.f_number)
