"""corpus.py on lenses made here, and its tools against known values."""

import csv
import subprocess
import sys
from pathlib import Path

import corpus
import corpus_examination
import corpus_image_checks
import numpy as np
import program
import pytest
import sequential_rays
from numpy.polynomial import polynomial

HEAD = """VERS 191028 13541 33913 33913
MODE SEQ
NAME {name}
UNIT MM X W X CM MR CPMM
ENPD 4.0
FTYP 0 0 2 1 0 0 0 2
XFLN 0 0
YFLN 0 8
WAVM 1 0.55 1
PWAV 1
SURF 0
  TYPE STANDARD
  CURV 0
  DISZ INFINITY
SURF 1
  STOP
  TYPE STANDARD
  CURV 0
  DISZ 2
SURF 2
  TYPE EVENASPH
  CURV 0.05
  CONI -0.6
  PARM 2 -1e-4
  PARM 3 1e-7
  DISZ 3
  GLAS {glass}
SURF 3
  TYPE STANDARD
  CURV -0.05
  DISZ 18
SURF 4
  TYPE STANDARD
  CURV 0
  DISZ 0
"""
# Six decimals of an index and of a length are 1e-6 of a focal length of 20 mm.
MODEL_GLASS = "___BLANK 1 0 1.55 56"


def rows_of(folder, output, *options):
    command = [sys.executable, Path(corpus.__file__), folder, "--output", output, "--program", program.path(), *options]
    said = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=True).stdout
    with (output / "corpus.csv").open(newline="") as file:
        return {row["file"]: row for row in csv.DictReader(file)}, said


def test_correct_asphere_is_right_and_mirror_is_refused(tmp_path, figures):
    lenses = tmp_path / "lenses"
    lenses.mkdir()
    (lenses / "asphere.zmx").write_text(HEAD.format(name="asphere", glass=MODEL_GLASS))
    (lenses / "MIRROR.ZMX").write_text(HEAD.format(name="mirror", glass="MIRROR 0 0 1.5 40"), encoding="utf-16")
    (lenses / "readme.txt").write_text("no lens")
    rows, _ = rows_of(lenses, tmp_path / "out")
    assert set(rows) == {"asphere.zmx", "MIRROR.ZMX"}
    sound, mirror = rows["asphere.zmx"], rows["MIRROR.ZMX"]
    assert sound["verdict"] == "right", sound
    assert (sound["faces"], sound["aspheres"]) == ("2", "1")
    assert mirror["verdict"] == "refused" and "odd number of mirrors" in mirror["reason"], mirror
    for check in ("first_order_error", "image_point_error", "irradiance_error"):
        figures.append(f"corpus: {check} of an aspheric singlet {float(sound[check]):.1e}")
    text = (tmp_path / "out/corpus.md").read_text()
    assert "1 right, 1 refused" in text
    # Rows of the same program are kept.
    again, said = rows_of(lenses, tmp_path / "out")
    assert again == rows and "2 of them done" in said


def test_file_that_ends_in_glass_gets_an_image_surface(tmp_path):
    lenses = tmp_path / "lenses"
    lenses.mkdir()
    text = HEAD.format(name="plate", glass=MODEL_GLASS).replace("DISZ 18", "DISZ 10")
    plate = f"  TYPE STANDARD\n  CURV 0\n  DISZ 0.3\n  GLAS {MODEL_GLASS}\nSURF 5\n  TYPE STANDARD\n  CURV 0\n  DISZ 7.8\n"
    (lenses / "plate.zmx").write_text(text[: text.index("SURF 4") + 7] + plate)
    rows, _ = rows_of(lenses, tmp_path / "out", "--stage", "import")
    assert rows["plate.zmx"]["verdict"] == "right", rows["plate.zmx"]
    assert rows["plate.zmx"]["faces"] == "4"


@pytest.fixture
def lit_disc():
    y, x = np.indices((200, 200)) - 99.5
    return np.where(np.hypot(x, y) < 90, 0.1 * np.cos(np.hypot(x, y) / 120) ** 4, 0)


def test_uniform_disc_passes_the_image_checks(lit_disc):
    row = corpus_examination.Row("disc", "")
    corpus_image_checks.look_at_image(lit_disc, row)
    assert row.failures == []


@pytest.mark.parametrize("places", [1, 4], ids=["one", "the same in every quarter"])
def test_missing_tile_is_detected(lit_disc, places):
    for _ in range(places):
        lit_disc[40:56, 60:76] = 0
        lit_disc = np.rot90(lit_disc)
    row = corpus_examination.Row("tile", "")
    corpus_image_checks.look_at_image(lit_disc, row)
    assert row.failures != []


def test_kinds_have_no_position_name_or_number():
    one = "error: /a/b c.zmx:263: surface 11: unknown glass 'BK7'; give the catalogue that has it with --glass FILE.agf"
    two = "error: other.ZMX:9: surface 4: unknown glass 'PMMA'; give the catalogue that has it with --glass FILE.agf"
    assert corpus_examination.kind_of(one) == corpus_examination.kind_of(two) == "surface N: unknown glass '...'"


def test_forbes_polynomials_match_the_published_values():
    x = np.linspace(0, 1, 7)
    for made, published in [
        (sequential_rays.q_bfs_series([0, 1]), (13 - 16 * x) / np.sqrt(19)),
        (sequential_rays.q_bfs_series([0, 0, 1]), np.sqrt(2 / 95) * (29 - 4 * x * (25 - 19 * x))),
        (sequential_rays.q_con_series([0, 1]), -(5 - 6 * x)),
        (sequential_rays.q_con_series([0, 0, 1]), 15 - 14 * x * (3 - 2 * x)),
    ]:
        assert polynomial.polyval(x, made) == pytest.approx(published, abs=1e-12)


def test_slopes_are_derivatives_of_every_shape():
    face = sequential_rays.Face(0, 0.2, -0.4, 2, 1.5)
    face.even, face.odd = np.array([0, 0.01, -2e-3, 1e-4]), np.array([0, 3e-3, -1e-4])
    face.q_bfs = (2.5, sequential_rays.q_bfs_series([1e-2, -3e-3, 2e-3]))
    face.q_con = (2.5, sequential_rays.q_con_series([1e-2, 2e-3, -1e-3]))
    r, step = np.linspace(0.1, 1.9, 10), 1e-5
    numeric = (face.sag(r + step) - face.sag(r - step)) / (2 * step)
    assert face.sag_and_slope(r)[1] == pytest.approx(numeric, abs=1e-8)


def test_first_intersection_is_taken():
    # The front of a ball, so steep that a ray across intersects its disc twice; from both sides.
    face = sequential_rays.Face(0, 1 / 3, 0, 2.9, 1.5)
    for begin, sideways in [(-5.0, 0.3), (5.0, -0.3)]:
        p = np.array([[0.0], [begin], [0.5 * 3]])
        d = np.array([[0.0], [sideways], [1e-9]])
        d /= np.linalg.norm(d)
        t = sequential_rays.intersect(face, 2.9, p, d)
        assert (p + t * d)[1, 0] == pytest.approx(np.sign(begin) * np.sqrt(9 - 1.5**2), abs=1e-6)


def test_irradiance_of_a_plane_plate_is_pi_sine_squared():
    # Two plane faces of index 1 are only a stop: pi sin^2 of its half angle, seen from the axis.
    faces = [sequential_rays.Face(z, 0, 0, 5, 1.0) for z in (0.0, 1.0)]
    lens = sequential_rays.Lens(faces, [sequential_rays.Stop(0, -1.0, 2.0)])
    found, error = sequential_rays.irradiance(lens, 0.0, 9.0, -100.0, 1000.0)
    assert found == pytest.approx(np.pi * 4 / 104, rel=3e-3)
    assert error < 1e-3 * found
