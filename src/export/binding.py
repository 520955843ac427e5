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


_WANTED = (
    "a gray image of %d x %d pixels of 8 bits: a NumPy array of dtype uint8 and shape (%d, %d), a Pillow image of "
    "mode L, or %d bytes, row by row" % (WIDTH, HEIGHT, HEIGHT, WIDTH, WIDTH * HEIGHT))


def _unfit(error, image, trait=""):
    """The error for what is no image of this detector's."""
    kind = type(image)
    name = kind.__name__ if kind.__module__ == "builtins" else "%s.%s" % (kind.__module__, kind.__name__)
    return error("this is not an image for @NAME@: %s%s. It takes %s" % (name, trait, _WANTED))


def _frame(image):
    """Address of the first pixel, row stride, pixel stride, and what must live as long as the address is used."""
    mode = getattr(image, "mode", None)
    if mode != "L" and any(kind.__module__ == "PIL.Image" for kind in type(image).__mro__):
        # The bytes of a palette image are no grays, though they look alike.
        raise _unfit(TypeError, image, " of mode %r" % (mode,))
    interface = getattr(image, "__array_interface__", None)
    if interface is not None:
        return _array(image, interface)
    try:
        view = memoryview(image)
    except TypeError:
        raise _unfit(TypeError, image) from None
    # One byte has no order of bytes, but its format may say one.
    if view.format.lstrip("@=<>!") != "B":
        raise _unfit(TypeError, image, " of format %r and shape %r" % (view.format, view.shape))
    if view.shape not in ((HEIGHT, WIDTH), (WIDTH * HEIGHT,)):
        raise _unfit(ValueError, image, " of shape %r" % (view.shape,))
    address, alive = _buffer(image, view)
    return address, WIDTH, 1, alive


def _buffer(owner, view):
    """Address of the first byte of a view, in its order, and what keeps it there."""
    if view.c_contiguous and not view.readonly:
        alive = (ctypes.c_uint8 * view.nbytes).from_buffer(view)
        return ctypes.addressof(alive), alive
    alive = owner if type(owner) is bytes else view.tobytes()
    return ctypes.cast(alive, ctypes.c_void_p).value, alive


def _array(image, interface):
    """The same for what has NumPy's array interface, version 3."""
    if not isinstance(interface, dict):
        raise _unfit(TypeError, image, " whose array interface is no dictionary")
    typestr, shape = interface.get("typestr"), interface.get("shape")
    if typestr not in ("|u1", "=u1", "<u1", ">u1"):
        raise _unfit(TypeError, image, " of dtype %r and shape %r" % (typestr, shape))
    if not isinstance(shape, (tuple, list)) or tuple(shape) != (HEIGHT, WIDTH):
        raise _unfit(ValueError, image, " of shape %r" % (shape,))
    if interface.get("mask") is not None:
        raise _unfit(TypeError, image, " with a mask")
    strides, data, offset = interface.get("strides"), interface.get("data"), interface.get("offset", 0)
    try:
        row, pixel = (WIDTH, 1) if strides is None else map(operator.index, strides)
    except (TypeError, ValueError):
        raise _unfit(TypeError, image, " of strides %r" % (strides,)) from None
    if not isinstance(offset, int):
        raise _unfit(TypeError, image, " of offset %r" % (offset,))
    # The bytes that belong to it lie from low to high, counted from the first pixel.
    across, down = (WIDTH - 1) * pixel, (HEIGHT - 1) * row
    low, high = min(0, across) + min(0, down), max(0, across) + max(0, down) + 1
    if isinstance(data, tuple):
        address, alive = data[0] if len(data) == 2 else None, (image, interface)
        if type(address) is not int or offset != 0:
            raise _unfit(TypeError, image, " of data %r and offset %r" % (data, offset))
        if address + low <= 0 or address + high > 2 * sys.maxsize or high - low > sys.maxsize:
            raise _unfit(ValueError, image, " at address %#x, of strides %r" % (address, (row, pixel)))
    else:
        owner = image if data is None else data
        try:
            view = memoryview(owner)
        except TypeError:
            raise _unfit(TypeError, image, " whose data is neither address nor buffer: %s" % type(owner)) from None
        if not view.c_contiguous or offset + low < 0 or offset + high > view.nbytes:
            raise _unfit(ValueError, image, " of strides %r and offset %d in a buffer of %d bytes%s" % (
                (row, pixel), offset, view.nbytes, "" if view.c_contiguous else " with gaps"))
        address, alive = _buffer(owner, view)
        address += offset
    if pixel > 0 and row > across:
        return address, row, pixel, alive
    # Mirrored, transposed or repeated pixels are put in order.
    span = memoryview((ctypes.c_uint8 * (high - low)).from_address(address + low))
    copy = bytearray()
    for y in range(HEIGHT):
        first = y * row - low
        end = first + WIDTH * pixel
        if pixel:
            copy += span[first:end if end >= 0 else None:pixel].tobytes()
        else:
            copy += span[first:first + 1].tobytes() * WIDTH
    address, alive = _buffer(copy, memoryview(copy))
    return address, WIDTH, 1, alive


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
        columns, floats = ctypes.POINTER(ctypes.c_int32), ctypes.POINTER(ctypes.c_float)
        frame = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_size_t, columns, ctypes.c_size_t]
        self._info = self._function("info", [], ctypes.POINTER(_Info))
        found = self.info()
        program = zlib.crc32(found.program.encode("utf-8"))
        if (found.abi, found.width, found.height, found.median, found.has_ranges, program) != (
                ABI, WIDTH, HEIGHT, MEDIAN, HAS_RANGES, _PROGRAM):
            raise ValueError("%s.py and its library are of different exports: take both from one" % NAME)
        self._detect = self._function("detect", frame + [floats], ctypes.c_int)
        if HAS_RANGES:
            self._ranges = self._function("ranges", frame + [floats, ctypes.POINTER(_Range)], ctypes.c_int)
            self._reset = self._function("reset", [floats, ctypes.c_size_t], None)

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

        image: 8 bits a pixel, of shape (height, width): what has NumPy's array interface, as arrays of dtype uint8
        and Pillow images of mode L, or a buffer, as bytes, bytearray and memoryview, also of width * height bytes
        row by row. Strides of every kind are taken; negative and overlapping ones, and buffers that are read-only
        or have gaps, cost a copy. columns: whole numbers from 0 to width - 1.

        A row is unrounded, and may lie outside the image or be no finite number: then nothing is known. Raises
        TypeError if the image is of another kind or dtype, ValueError if its shape or a column does not fit.
        """
        columns = _columns(columns)
        address, row, pixel, alive = _frame(image)
        rows = (ctypes.c_float * len(columns))()
        _check(self._detect(address, row, pixel, columns, len(columns), rows))
        del alive
        return list(rows)
@RANGES@
