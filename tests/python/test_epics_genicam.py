"""examples/epics_station: a simulated GigE Vision camera by Aravis on loopback, beside the motors of the soft IOC."""

import ctypes
import unittest
from unittest import mock

try:
    import caproto  # noqa: F401
except ImportError:
    raise unittest.SkipTest("caproto is not installed; ./quickstart test installs it into .python/") from None
import epics
from epics import ALL_STOPPED, SIZE, StationCase, eventually

try:
    ctypes.CDLL("libaravis-0.8.so.0")
except OSError:
    raise unittest.SkipTest("Aravis is not installed: apt-get install libaravis-0.8-0") from None


class GenICam(StationCase):
    def begin(self, *options, **camera):
        """A station whose trial has begun, with the camera at a loopback address."""
        self.start_ioc("--genicam", "127.0.0.1", *options)
        facts = {"genicam": "127.0.0.1", "width": SIZE, "height": SIZE, "exposure_s": 0.02, "counts_at_1": 255, **camera}
        path = self.folder / "station.json"
        self.write_layout()
        path.write_text(epics.json.dumps({**epics.json.loads(path.read_text()), "camera": facts}))
        station = self.make_station(timeout_s=20.0)
        station.begin(1)
        return station

    def test_images_show_the_lens_that_the_motors_move(self):
        station = self.begin("--noise-level", "none")
        first, seconds = station.capture()
        self.assertEqual((first.shape, first.dtype), ((SIZE, SIZE), epics.np.float32))
        self.assertGreater(seconds, 0)

        def mean_image(move):
            station.move_by([move, 0, 0, 0, 0])
            return epics.np.mean([station.capture()[0] for _ in range(8)], axis=0)

        here, there, again = mean_image(0.0), mean_image(0.3), mean_image(-0.3)
        noise = epics.np.sqrt(epics.np.mean((again - here) ** 2))
        self.assertGreater(epics.np.sqrt(epics.np.mean((there - here) ** 2)), 2 * noise)

    def test_a_camera_lost_in_the_middle_of_a_trial_stops_the_motors(self):
        station = self.begin("--fault", "no-camera:1")
        station.capture()
        station.move_by([0.05, 0, 0, 0, 0])
        self.assert_fails(station.capture, "the camera 127.0.0.1: ", "check its power, its cable", ALL_STOPPED)
        eventually(lambda: self.log().count(" STOP at ") == 5, "STOP of five motors")

    def test_names_the_camera_that_does_not_answer(self):
        self.start_ioc()
        path = self.folder / "station.json"
        self.write_layout()
        facts = {"genicam": "127.0.0.1", "width": SIZE, "height": SIZE, "exposure_s": 0.02, "counts_at_1": 255}
        path.write_text(epics.json.dumps({**epics.json.loads(path.read_text()), "camera": facts}))
        station = self.make_station()
        self.assert_fails(lambda: station.begin(1), "the camera 127.0.0.1: Can't connect to device", ALL_STOPPED)
        self.assertNotIn(" moves to ", self.log())

    def test_explains_a_missing_library(self):
        genicam = epics.importlib.import_module("genicam")
        with mock.patch.object(genicam, "LIBRARY", "libaravis-none.so"), self.assertRaisesRegex(
                RuntimeError, "libaravis-none.so is not installed; on Debian: apt-get install libaravis-0.8-0"):
            genicam.GenICam({"genicam": "127.0.0.1", "exposure_s": 0.1}, None, 1.0)


del StationCase  # the base has no tests

if __name__ == "__main__":
    unittest.main()
