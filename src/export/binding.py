"""@NAME@: a visual obstacle detector for gray images of @WIDTH@ x @HEIGHT@ pixels, exported by vsonar @VERSION@.

It finds, in columns of an image, the row of the lowest pixel that is not floor. Rows and columns are in pixels and
count from 0 at the top left.

    import @NAME@
    detector = @NAME@.Detector()
    rows = detector.detect(image, [40, 160, 280])

The shared library is looked for beside this file; NumPy is not needed.
"""

import collections
import ctypes
import operator
import os
import sys
import zlib

NAME = "@NAME@"
ABI = @ABI@
WIDTH = @WIDTH@
HEIGHT = @HEIGHT@
MEDIAN = @MEDIAN@
HAS_RANGES = bool(@HAS_RANGES@)
_PROGRAM = @PROGRAM@  # checksum (CRC-32) of the program's text

Info = collections.namedtuple(
    "Info", "abi width height median has_ranges correct cases seed version name data program")
Info.__doc__ = """What the detector is and where it comes from.

correct of cases: training cases answered correctly, None if unknown; seed: of its run, None if unknown; version: of
vsonar; data: the data set, empty if unknown; program: its text.
"""


class _Info(ctypes.Structure):
    _fields_ = (
        [(name, ctypes.c_int32) for name in
         ("abi", "width", "height", "median", "has_ranges", "correct", "cases", "has_seed")]
        + [("seed", ctypes.c_uint64)]
        + [(name, ctypes.c_char_p) for name in ("version", "name", "data", "program")])


def _library_path():
    """Where the shared library is: beside this file, under this platform's name for it."""
    names = {"darwin": "lib@NAME@.dylib", "win32": "@NAME@.dll", "cygwin": "@NAME@.dll"}
    folder = os.path.dirname(os.path.abspath(__file__))
    return os.path.join(folder, names.get(sys.platform, "lib@NAME@.so"))


def _frame(image):
    """Address, row stride, pixel stride, and what must live as long as the address is used."""
    interface = getattr(image, "__array_interface__", None)
    if interface is not None:
        return _array(image, interface)
    try:
        view = memoryview(image)
    except TypeError:
        raise TypeError(
            "an image is an array of NumPy or bytes-like, not %s" % type(image).__name__) from None
    if view.itemsize != 1 or view.format not in ("B", "b", "c"):
        raise ValueError("pixels must be single bytes, not of format %r" % view.format)
    if view.ndim == 2 and view.shape != (HEIGHT, WIDTH):
        raise ValueError("the image must be of shape (%d, %d), not %r" % (HEIGHT, WIDTH, view.shape))
    if view.ndim > 2 or view.nbytes != WIDTH * HEIGHT:
        raise ValueError(
            "the image must be %d x %d = %d bytes, row by row, not %d"
            % (WIDTH, HEIGHT, WIDTH * HEIGHT, view.nbytes))
    if view.readonly or not view.c_contiguous:
        data = image if isinstance(image, bytes) else view.tobytes()
        return ctypes.cast(ctypes.c_char_p(data), ctypes.c_void_p), WIDTH, 1, data
    data = (ctypes.c_uint8 * view.nbytes).from_buffer(view)
    return ctypes.cast(data, ctypes.c_void_p), WIDTH, 1, data


def _array(image, interface):
    """The same for what has NumPy's array interface. Views are used as they are, whatever their strides."""
    shape, strides = interface["shape"], interface.get("strides")
    if interface["typestr"][1:] != "u1":
        raise ValueError("pixels must be of type uint8, not %s" % interface["typestr"])
    if tuple(shape) != (HEIGHT, WIDTH):
        raise ValueError("the image must be of shape (%d, %d), not %r" % (HEIGHT, WIDTH, tuple(shape)))
    row, pixel = strides or (WIDTH, 1)
    if row <= 0 or pixel <= 0:
        raise ValueError(
            "strides must be positive, not %r; copy the view first, as in numpy.ascontiguousarray(image)"
            % ((row, pixel),))
    if row < (WIDTH - 1) * pixel + 1:
        raise ValueError("rows must not overlap: copy the view first, as in numpy.ascontiguousarray(image)")
    return ctypes.c_void_p(interface["data"][0]), row, pixel, (image, interface)


def _columns(columns):
    numbers = [operator.index(column) for column in columns]
    for number in numbers:
        if not 0 <= number < WIDTH:
            raise ValueError("column %d is outside the image, whose columns are 0 to %d" % (number, WIDTH - 1))
    return (ctypes.c_int32 * len(numbers))(*numbers)


def _check(error):
    if error != 0:
        causes = {-1: "a null pointer", -2: "strides that do not fit the image", -3: "a column outside the image"}
        raise ValueError("@NAME@ refuses: %s" % causes.get(error, "error %d" % error))


class Detector:
    """The detector. It keeps nothing from frame to frame, so one may serve any number of threads."""

    width, height = WIDTH, HEIGHT

    def __init__(self, library=None):
        """Loads the shared library: the one beside this file, or `library`, a path.

        Raises OSError if it cannot be loaded, ValueError if it is another detector's than this module's.
        """
        self._library = ctypes.CDLL(_library_path() if library is None else os.fspath(library))
        frame = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t, ctypes.c_void_p, ctypes.c_size_t]
        self._info = self._function("info", [], ctypes.POINTER(_Info))
        found = self.info()
        program = zlib.crc32(found.program.encode("utf-8"))
        if (found.abi, found.width, found.height, found.median, found.has_ranges, program) != (
                ABI, WIDTH, HEIGHT, MEDIAN, HAS_RANGES, _PROGRAM):
            raise ValueError("%s.py and its library are of different exports: take both from one" % NAME)
        self._detect = self._function("detect", frame + [ctypes.c_void_p], ctypes.c_int)
        if HAS_RANGES:
            self._ranges = self._function("ranges", frame + [ctypes.c_void_p, ctypes.c_void_p], ctypes.c_int)
            self._reset = self._function("reset", [ctypes.c_void_p, ctypes.c_size_t], None)

    def _function(self, name, arguments, result):
        try:
            function = getattr(self._library, "%s_%s" % (NAME, name))
        except AttributeError:
            raise ValueError("the library has no %s_%s: it is not this detector's" % (NAME, name)) from None
        function.argtypes, function.restype = arguments, result
        return function

    def info(self):
        """What the detector is and where it comes from: an Info."""
        raw = self._info().contents
        text = [value.decode("utf-8", "replace") for value in (raw.version, raw.name, raw.data, raw.program)]
        known = raw.cases >= 0
        return Info(
            raw.abi, raw.width, raw.height, raw.median, bool(raw.has_ranges), raw.correct if known else None,
            raw.cases if known else None, raw.seed if raw.has_seed else None, *text)

    def detect(self, image, columns):
        """The row of the lowest pixel that is not floor, in each of the columns: a list of floats.

        image: a NumPy array of type uint8 and shape (height, width), also a view with positive strides; or bytes,
        bytearray or memoryview of width * height pixels, row by row. columns: whole numbers from 0 to width - 1.

        A row is unrounded, and may lie outside the image or be no finite number: then nothing is known. Raises
        ValueError if the image or a column does not fit.
        """
        columns = _columns(columns)
        address, row, pixel, alive = _frame(image)
        rows = (ctypes.c_float * len(columns))()
        _check(self._detect(address, row, pixel, columns, len(columns), rows))
        del alive
        return list(rows)
@RANGES@
