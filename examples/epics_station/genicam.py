"""A GenICam camera, GigE Vision or USB3 Vision, by Aravis. See README.md.

Aravis is called through its C interface (libaravis-0.8), because its Python bindings exist for the system's Python only.
"""
import ctypes
import time

import numpy as np

LIBRARY = "libaravis-0.8.so.0"
MONO = {0x01080001: np.uint8, 0x01100003: np.uint16, 0x01100005: np.uint16, 0x01100007: np.uint16}  # Mono8, 10, 12, 16
STATUS = {1: "cleared", 2: "timeout", 3: "missing packets", 4: "wrong packet", 5: "size mismatch", 6: "filling", 7: "aborted"}
POINTER, INT, TEXT = ctypes.c_void_p, ctypes.c_int, ctypes.c_char_p


class GError(ctypes.Structure):
    _fields_ = (("domain", ctypes.c_uint32), ("code", INT), ("message", TEXT))


def aravis():
    """A function that calls the library: call(name, result type, (type, value), ...)."""
    try:
        library = ctypes.CDLL(LIBRARY)
    except OSError:
        raise RuntimeError(f"{LIBRARY} is not installed; on Debian: apt-get install libaravis-0.8-0") from None

    def call(name, result, *arguments):
        function = getattr(library, name)
        function.restype, function.argtypes = result, [kind for kind, _ in arguments]
        return function(*(value for _, value in arguments))

    return call


class GenICam:
    """A camera, with the methods of `AreaDetector`.

    Args:
        facts: Of the layout: genicam, width, height, exposure_s.
        channels: Of the motors; not used.
        timeout_s: Time limit for an image, besides its exposure.
    """

    def __init__(self, facts, channels, timeout_s):
        self.facts, self.timeout_s, self.address = facts, timeout_s + facts["exposure_s"], facts["genicam"]
        self.call, self.camera = aravis(), None

    @staticmethod
    def names(facts):
        return []

    @staticmethod
    def stops():
        return {}

    def ask(self, name, result, *arguments):
        """The result of a function that can fail."""
        error = ctypes.POINTER(GError)()
        made = self.call(name, result, *arguments, (POINTER, ctypes.addressof(error)))
        if error:
            raise RuntimeError(f"the camera {self.address}: {error.contents.message.decode()} ({name}); check its power, its "
                               "cable and whether another program uses it")
        return made

    def prepare(self):
        """Opens the camera, anew in each trial, and sets the layout's region and exposure."""
        if self.camera:
            self.call("g_object_unref", None, (POINTER, self.camera))
        self.camera = None
        self.camera = self.ask("arv_camera_new", POINTER, (TEXT, self.address.encode()))
        camera, size = (POINTER, self.camera), [(INT, self.facts["width"]), (INT, self.facts["height"])]
        self.ask("arv_camera_set_region", None, camera, (INT, 0), (INT, 0), *size)
        self.ask("arv_camera_set_exposure_time", None, camera, (ctypes.c_double, self.facts["exposure_s"] * 1e6))

    def capture(self):
        """Counts of a new image, shape (height, width)."""
        began, limit = time.monotonic(), (ctypes.c_uint64, int(self.timeout_s * 1e6))
        buffer = self.ask("arv_camera_acquisition", POINTER, (POINTER, self.camera), limit)
        if not buffer:
            raise RuntimeError(f"no image arrived from the camera {self.address} within {time.monotonic() - began:.3g} s; "
                               "check its trigger, the network and the firewall (UDP)")
        try:
            return self.pixels((POINTER, buffer))
        finally:
            self.call("g_object_unref", None, (POINTER, buffer))

    def pixels(self, buffer):
        status = self.call("arv_buffer_get_status", INT, buffer)
        if status:
            raise RuntimeError(f"the camera {self.address} sent a damaged image ({STATUS.get(status, status)}); "
                               "check the network "
                               "and its packet size")
        found = [self.call(f"arv_buffer_get_image_{side}", INT, buffer) for side in ("width", "height")]
        width, height = self.facts["width"], self.facts["height"]
        if found != [width, height]:
            raise RuntimeError(f"the camera {self.address} has images of {found[0]} x {found[1]}, the layout says "
                               f"{width} x {height}; correct the layout")
        pixel_format = self.call("arv_buffer_get_image_pixel_format", ctypes.c_uint32, buffer)
        if pixel_format not in MONO:
            raise RuntimeError(f"the camera {self.address} has the pixel format {pixel_format:#010x}; set its PixelFormat to "
                               "Mono8, Mono10, Mono12 or Mono16")
        size = ctypes.c_size_t()
        data = self.call("arv_buffer_get_data", POINTER, buffer, (POINTER, ctypes.addressof(size)))
        return np.frombuffer(ctypes.string_at(data, size.value), MONO[pixel_format], width * height).reshape(height, width)


class FakeCamera:
    """Aravis's simulated GigE Vision camera, on UDP port 3956.

    Args:
        address: Of a network interface of this machine.
        frame: Called in a thread for each image; returns counts of type uint8, shape (height, width).
    """

    def __init__(self, address, frame):
        self.call = aravis()
        self.camera = self.call("arv_gv_fake_camera_new", POINTER, (TEXT, address.encode()), (TEXT, b"RELIGN1"))
        if not self.call("arv_gv_fake_camera_is_running", INT, (POINTER, self.camera)):
            raise RuntimeError(f"no camera can be simulated at {address}: is it an address of this machine, "
                               "is UDP port 3956 free?")

        @ctypes.CFUNCTYPE(None, POINTER, POINTER, ctypes.c_uint32, ctypes.c_uint32, ctypes.c_uint32)
        def fill(buffer, *_):
            counts, buffer = np.ascontiguousarray(frame()), (POINTER, buffer)
            sides = [self.call(f"arv_buffer_get_image_{side}", INT, buffer) for side in ("height", "width")]
            if list(counts.shape) == sides:
                data = self.call("arv_buffer_get_data", POINTER, buffer, (POINTER, None))
                ctypes.memmove(data, counts.ctypes.data, counts.size)

        self.fill = fill  # kept, because the library does not
        fake = self.call("arv_gv_fake_camera_get_fake_camera", POINTER, (POINTER, self.camera))
        self.call("arv_fake_camera_set_fill_pattern", None, (POINTER, fake), (type(fill), fill), (POINTER, None))

    def close(self):
        """Takes it off the network."""
        if self.camera:
            self.call("g_object_unref", None, (POINTER, self.camera))
        self.camera = None
