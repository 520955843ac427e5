"""Checks the binding det.py beside this file; with the argument `numpy`, on arrays too."""

import array
import ctypes
import math
import mmap
import os
import pickle
import shutil
import struct
import sys
import threading

folder = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, folder)
sys.dont_write_bytecode = True
import det  # noqa: E402

with open(os.path.join(folder, "pixels"), "rb") as file:
    pixels = file.read()
with open(os.path.join(folder, "rows")) as file:
    expected = [int(word) for word in file.read().split()]
W, H = det.WIDTH, det.HEIGHT
detector = det.Detector()


def bits(values):
    return list(struct.unpack("%dI" % len(values), struct.pack("%df" % len(values), *values)))


def good(image):
    assert bits(detector.detect(image, range(W))) == expected


def bad(kind, text, call, *arguments):
    try:
        call(*arguments)
    except kind as fault:
        assert text in str(fault), fault
    else:
        raise AssertionError("%s with %r must fail" % (call, arguments))


# Bytes-like images.
assert len(pixels) == W * H and (detector.width, detector.height) == (W, H)
good(pixels)
good(bytearray(pixels))
good(memoryview(pixels))
good(memoryview(bytearray(pixels)))
good(memoryview(pixels).cast("B", (H, W)))
wide = bytearray(2 * W * H)
wide[::2] = pixels
good(memoryview(wide)[::2])
for start in range(2):
    aligned = bytearray(start) + bytearray(pixels)
    good(memoryview(aligned)[start:])
good(memoryview(wide)[::2].toreadonly())
good((ctypes.c_uint8 * (W * H)).from_buffer_copy(pixels))
good(((ctypes.c_uint8 * W) * H).from_buffer_copy(pixels))
good(array.array("B", pixels))
backwards = bytearray(pixels[::-1])
good(memoryview(backwards)[::-1])
with mmap.mmap(-1, W * H) as mapped:
    mapped.write(pixels)
    good(mapped)


def unfit(kind, text, image):
    """A refusal names what came and what is wanted."""
    for found in (text, "dtype uint8 and shape (%d, %d)" % (H, W), "mode L", "%d bytes" % (W * H)):
        bad(kind, found, detector.detect, image, [0])


unfit(ValueError, "bytes of shape (%d,)" % (W * H - 1), pixels[1:])
unfit(ValueError, "bytes of shape (%d,)" % (W * H + 1), pixels + b"x")
unfit(ValueError, "memoryview of shape (%d, %d)" % (W, H), memoryview(pixels).cast("B", (W, H)))
unfit(ValueError, "of shape (1, %d, %d)" % (H, W), memoryview(pixels).cast("B", (1, H, W)))
unfit(ValueError, "of shape ()", memoryview(b"x").cast("B", ()))
unfit(TypeError, "of format 'I' and shape (%d,)" % (W * H), memoryview(bytearray(4 * W * H)).cast("I"))
unfit(TypeError, "array.array of format 'b'", array.array("b", bytes(W * H)))
unfit(TypeError, "of format '?'", memoryview(bytes(W * H)).cast("?"))
unfit(TypeError, ": list.", list(pixels))
unfit(TypeError, ": str.", "x" * W * H)
unfit(TypeError, ": NoneType.", None)
unfit(TypeError, ": int.", 77)


# NumPy's array interface, as others export it.
class Exporter:
    def __init__(self, data=None, **fields):
        self.__array_interface__ = {"version": 3, "typestr": "|u1", "shape": (H, W), "data": data, **fields}


def without(*names):
    exporter = Exporter()
    for name in names:
        del exporter.__array_interface__[name]
    return exporter


def held(data):
    """A pointer to a copy, that lives as long as what holds it."""
    copy = (ctypes.c_uint8 * len(data)).from_buffer_copy(data)
    return copy, ctypes.addressof(copy)


class Fresh:
    """As Pillow's images do it: bytes that nobody else holds, made when they are asked for."""
    @property
    def __array_interface__(self):
        return {"version": 3, "data": bytes(bytearray(pixels)), "shape": (H, W), "typestr": "|u1"}


good(Fresh())
for data in (pixels, bytearray(pixels), memoryview(pixels), array.array("B", pixels),
             memoryview(pixels).cast("B", (H, W)), (ctypes.c_uint8 * (W * H)).from_buffer_copy(pixels)):
    good(Exporter(data))
    good(Exporter(data, strides=None))
    good(Exporter(data, strides=(W, 1), offset=0, descr=[("", "|u1")], mask=None))
    good(Exporter(data, typestr=">u1", shape=[H, W]))
    for wrong in ({"offset": 1}, {"offset": -1}, {"strides": (W + 1, 1)}, {"strides": (W, 2)}, {"strides": (-W, 1)}):
        unfit(ValueError, "in a buffer of %d bytes" % (W * H), Exporter(data, **wrong))
copy, address = held(pixels)
good(Exporter((address, False)))
good(Exporter((address, True), strides=(W, 1)))
flipped, address = held(pixels[::-1])
good(Exporter((address + W * H - 1, False), strides=(-W, -1)))
good(Exporter(pixels[::-1], strides=(-W, -1), offset=W * H - 1))
good(Exporter(bytes(7) + pixels, offset=7))
good(Exporter(bytearray(7) + pixels, offset=7))
columnwise = bytes(pixels[y * W + x] for x in range(W) for y in range(H))
copy, address = held(columnwise)
good(Exporter((address, True), strides=(1, H)))
good(Exporter(columnwise, strides=(1, H)))
row, padded = W + 9, bytearray()
for y in range(H):
    padded += pixels[y * W:(y + 1) * W] + bytes(9)
del padded[-9:]
good(Exporter(padded, strides=(row, 1)))
good(Exporter(bytes(padded), strides=(row, 1)))
turned = bytes(padded[::-1])
good(Exporter(turned, strides=(-row, -1), offset=len(turned) - 1))
mirrored = b"".join(pixels[y * W:(y + 1) * W][::-1] for y in range(H))
good(Exporter(mirrored, strides=(W, -1), offset=W - 1))
upended = b"".join(pixels[y * W:(y + 1) * W] for y in reversed(range(H)))
good(Exporter(upended, strides=(-W, 1), offset=(H - 1) * W))
repeated = Exporter(pixels, strides=(0, 1))
assert bits(detector.detect(repeated, range(W))) == bits(detector.detect(pixels[:W] * H, range(W)))
smeared = Exporter(pixels, strides=(W, 0))
level = b"".join(pixels[y * W:y * W + 1] * W for y in range(H))
assert bits(detector.detect(smeared, range(W))) == bits(detector.detect(level, range(W)))


# Without data it is the object's own buffer.
class Own(bytearray):
    __array_interface__ = {"version": 3, "typestr": "|u1", "shape": (H, W)}


good(Own(pixels))
unfit(ValueError, "in a buffer of %d bytes" % (W * H - 1), Own(pixels[1:]))

unfit(TypeError, "Exporter of dtype '<u2' and shape (%d, %d)" % (H, W), Exporter(bytes(2 * W * H), typestr="<u2"))
for typestr in ("|b1", "|i1", "<f4", ">u2", "|V1", "|O8", "u1", b"|u1", None, 1):
    unfit(TypeError, "Exporter of dtype %r" % (typestr,), Exporter(pixels, typestr=typestr))
for shape in ((H, W, 3), (W, H), (W * H,), (), (H, W, 1), None, W * H, "HW"):
    unfit(ValueError, "Exporter of shape %r" % (shape,), Exporter(pixels, shape=shape))
for strides in ((W,), (W, 1, 1), (W, 1.0), 1, ("W", "1")):
    unfit(TypeError, "Exporter of strides %r" % (strides,), Exporter(pixels, strides=strides))
copy, address = held(pixels)
for data in (("77", False), (b"MMMM", True), (None, False), (True, False), (77.0, False), (address,), (), (address, 0, 0)):
    unfit(TypeError, "Exporter of data %r" % (data,), Exporter(data))
unfit(TypeError, "and offset 1", Exporter((address, False), offset=1))
unfit(TypeError, "of offset 1.5", Exporter(pixels, offset=1.5))
for address, strides in ((0, None), (-1, None), (5, (-W, 1)), (2 ** 64 - 1, None), (2 ** 70, None), (1, (2 ** 62, 1))):
    unfit(ValueError, "at address", Exporter((address, False), strides=strides))
for data in (77, [address, False], "MMMM"):
    unfit(TypeError, "neither address nor buffer: %s" % type(data), Exporter(data))
unfit(TypeError, "neither address nor buffer", without("data"))
unfit(TypeError, "neither address nor buffer", Exporter(None))
unfit(TypeError, "of dtype None", without("typestr"))
unfit(ValueError, "of shape None", without("shape"))
unfit(ValueError, "with gaps", Exporter(memoryview(wide)[::2]))
unfit(TypeError, "with a mask", Exporter(pixels, mask=Exporter(pixels)))
nonsense = Exporter()
for interface in ((), 77, "|u1", [("data", 77)]):
    nonsense.__array_interface__ = interface
    unfit(TypeError, "interface is no dictionary", nonsense)

# Columns.
assert detector.detect(pixels, []) == []
assert bits(detector.detect(pixels, [W - 1, 0, 0])) == [expected[W - 1], expected[0], expected[0]]
assert bits(detector.detect(pixels, (x for x in [3]))) == [expected[3]]
for column in (-1, W, 2 ** 32, -2 ** 32):
    bad(ValueError, "column %d" % column, detector.detect, pixels, [0, column])
bad(TypeError, "", detector.detect, pixels, [0.5])

# Ranges.
columns = [0, 7, W - 1]
other = bytes(i * i % 251 for i in range(W * H))
first, second = detector.detect(pixels, columns), detector.detect(other, columns)
assert first != second
ranges = detector.ranges(pixels, columns)
assert [r.row for r in ranges] == first
assert all(r.status in (det.OBSTACLE, det.NONE_IN_VIEW, det.INVALID) for r in ranges)
state = detector.state(3)
if det.MEDIAN == 3:
    assert all(math.isnan(value) for value in state.floats) and len(state.floats) == 6
assert [r.row for r in detector.ranges(pixels, columns, state)] == first
detector.ranges(other, columns, state)
if det.MEDIAN == 3:
    assert list(state.floats) == [value for pair in zip(second, first) for value in pair]
state.reset()
assert [r.row for r in detector.ranges(other, columns, state)] == second
bad(ValueError, "the state is of 3 columns, not 2", detector.ranges, pixels, [0, 1], state)
bad(ValueError, "0 columns or more", detector.state, -1)


class Forged:
    """A state with room for one float, that claims three columns."""
    n, floats = 3, (ctypes.c_float * 1)()


bad(TypeError, "not Forged", detector.ranges, pixels, columns, Forged())
bad(AttributeError, "", setattr, state, "n", 3)
bad(AttributeError, "", setattr, state, "floats", 77)
pickle.dumps(ranges)

# What it says of itself.
info = detector.info()
assert (info.abi, info.width, info.height, info.median, info.has_ranges) == (det.ABI, W, H, det.MEDIAN, True)
assert (info.correct, info.cases, info.seed) == (391, 426, 2 ** 64 - 1)
assert (info.name, info.data, info.program) == ("det", 'corridor "??/"', '("program" */ \u00e9)')

# Libraries by path.
copy = os.path.join(folder, "another")
shutil.copy(det._library_path(), copy)
assert det.Detector(copy).detect(pixels, [0]) == detector.detect(pixels, [0])
bad(OSError, "", det.Detector, os.path.join(folder, "none"))
det.MEDIAN += 1
bad(ValueError, "different exports", det.Detector, copy)
det.MEDIAN -= 1

# Several threads.
threads = [threading.Thread(target=good, args=(pixels,)) for _ in range(4)]
for thread in threads:
    thread.start()
for thread in threads:
    thread.join()

if sys.argv[1] != "numpy":
    assert "numpy" not in sys.modules
    sys.exit()

import numpy  # noqa: E402

frame = numpy.frombuffer(pixels, numpy.uint8).reshape(H, W)
good(frame)
good(frame.copy())
good(numpy.asfortranarray(frame.repeat(1)).reshape(H, W))
colour = numpy.zeros((H, W, 3), numpy.uint8)
colour[:, :, 1] = frame
good(colour[:, :, 1])
good(numpy.pad(frame, ((2, 3), (5, 4)))[2:2 + H, 5:5 + W])
big = numpy.zeros((2 * H, 2 * W), numpy.uint8)
big[::2, ::2] = frame
good(big[::2, ::2])
assert bits(detector.detect(frame, numpy.arange(W))) == expected
assert bits(detector.detect(frame, numpy.arange(W, dtype=numpy.uint8)[::-1])) == expected[::-1]
good(frame[::-1].copy()[::-1])
good(frame[:, ::-1].copy()[:, ::-1])
good(frame[::-1, ::-1].copy()[::-1, ::-1])
good(numpy.asfortranarray(frame))
big[:] = 0
big[::-2, ::-2] = frame
good(big[::-2, ::-2])
good(frame.astype(">u1"))
good(frame.view(numpy.recarray))
row = numpy.broadcast_to(frame[0], (H, W))
assert bits(detector.detect(row, range(W))) == bits(detector.detect(row.copy(), range(W)))
good(memoryview(frame))
good(memoryview(colour[:, :, 1]))
good(memoryview(frame[::-1].copy())[::-1])
for view in (frame[:-1], frame[:, 1:], frame.ravel(), colour, frame[:, :, None], numpy.uint8(77)):
    unfit(ValueError, "%s of shape %r" % (type(view).__name__, view.shape), view)
for dtype in ("<f4", "|i1", "|b1", ">u2", "<f8", "<c8", "|S1", "<M8[s]", "|O"):
    unfit(TypeError, "numpy.ndarray of dtype %r" % frame.astype(dtype).dtype.str, frame.astype(dtype))
unfit(TypeError, "of dtype '|V1'", frame.view([("level", numpy.uint8)]))
unfit(TypeError, "interface is no dictionary", numpy.ndarray)
bad(TypeError, "", detector.detect, frame, numpy.array([0.5]))

# Pillow's own images, where it is installed; `Fresh` is one of them as far as the protocol goes.
try:
    from PIL import Image
except ImportError:
    sys.exit()

picture = Image.frombytes("L", (W, H), pixels)
good(picture)
good(picture.copy().transpose(Image.FLIP_LEFT_RIGHT).transpose(Image.FLIP_LEFT_RIGHT))
plain = Image.new("L", (W, H), 77)
assert bits(detector.detect(plain, [0, W - 1])) == bits(detector.detect(bytes([77]) * (W * H), [0, W - 1]))
for mode in ("RGB", "1", "F", "LA", "P", "I;16"):
    unfit(TypeError, "of mode %r" % mode, picture.convert(mode))
unfit(TypeError, "of mode 'P'", picture.quantize(16))
unfit(ValueError, "of shape (%d, %d)" % (W, H), picture.resize((H, W)))
