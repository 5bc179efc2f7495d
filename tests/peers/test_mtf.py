"""MTF with diffraction against Optiland's FFT MTF of the same lens, aperture by aperture."""

import json
import warnings

import conftest
import numpy as np
import program

SCENE = program.LENS_FILE.parent / "scene.json"
# Near the best focus of this object: elsewhere, errors of several waves shift the frequencies of an FFT over a finite reference
# sphere by one per cent, which is more than the tolerance.
BEHIND_MM = 0.085
FREQUENCIES = (20, 50, 100, 200, 300)
ALLOWED = 0.01


def scene_with(side_mm, lp_per_mm, folder):
    """The paper's scene with a small sensor, which places the corners of its field."""
    scene = json.loads(SCENE.read_text())
    scene["lens"] = str(program.LENS_FILE)
    scene["sensor"] = {"z_mm": scene["sensor"]["z_mm"] + BEHIND_MM, "side_mm": side_mm, "pixels": 20}
    scene["spec"] = {"mtf": {"lp_per_mm": lp_per_mm, "diffraction": True}}
    file = folder / "scene.json"
    file.write_text(json.dumps(scene))
    return file


def ours(side_mm, lp_per_mm, folder):
    """MTF in the centre and in the corner, the lower of both directions."""
    scene_with(side_mm, lp_per_mm, folder)
    suite = {"name": "mtf", "scenes": ["scene.json"], "noise_levels": ["rho0"], "algorithms": ["random"], "instances": 1,
             "steps": 1}
    (folder / "suite.json").write_text(json.dumps(suite))
    said = program.call("validate", folder / "suite.json")
    line = next(line for line in said.splitlines() if line.startswith("MTF"))
    assert line.endswith("(with diffraction)"), line
    words = line.replace(",", "").split()
    return float(words[words.index("centre") + 1]), float(words[words.index("corner") + 1])


def field_mm(side_mm):
    """Height of the corner on the target: 0.8 of its ideal image's height, by Newton's equation."""
    lens, scene, data = program.lens(), json.loads(SCENE.read_text()), program.first_order()
    object_z = scene["emitter"]["z_mm"] + scene["pivot_behind_first_vertex_mm"]
    image_per_object = data["focal_length"] / (lens["elements"][0]["faces"][0]["z_mm"] + data["front_focal_length"] - object_z)
    return 0.8 * np.hypot(side_mm, side_mm) / 2 / image_per_object


def test_mtf_with_diffraction_matches_optiland(tmp_path, figures):
    conftest.need("optiland")
    import optiland_lens

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for side_mm in (0.3, 0.9):
            for at, name in ((0, "centre"), (1, "corner")):
                if at == 0 and side_mm != 0.3:
                    continue
                height = at * field_mm(side_mm)
                theirs = optiland_lens.fft_mtf(program.lens(), json.loads(SCENE.read_text()), height, BEHIND_MM, FREQUENCIES)
                found = [ours(side_mm, frequency, tmp_path)[at] for frequency in FREQUENCIES]
                deviation = max(abs(a - b) for a, b in zip(found, theirs))
                figures.append(f"optiland: MTF with diffraction, {name}, {height:.1f} mm off the axis: {deviation:.4f} at most")
                assert deviation < ALLOWED, (height, found, theirs)


def test_geometric_mtf_differs(tmp_path):
    scene = json.loads(scene_with(0.3, 200, tmp_path).read_text())
    both = ours(0.3, 200, tmp_path)[0]
    del scene["spec"]["mtf"]["diffraction"]
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    said = program.call("validate", tmp_path / "suite.json")
    assert "with diffraction" not in said
    assert abs(float(said.split("centre ")[1].split(",")[0]) - both) > 5 * ALLOWED
