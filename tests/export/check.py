"""Checks the binding det.py beside this file; with the argument `numpy`, on arrays too."""

import math
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
bad(ValueError, "= %d bytes" % (W * H), detector.detect, pixels[1:], [0])
bad(ValueError, "= %d bytes" % (W * H), detector.detect, pixels + b"x", [0])
bad(ValueError, "of shape", detector.detect, memoryview(pixels).cast("B", (W, H)), [0])
bad(ValueError, "single bytes", detector.detect, memoryview(bytearray(4 * W * H)).cast("I"), [0])
bad(TypeError, "bytes-like, not list", detector.detect, list(pixels), [0])

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

array = numpy.frombuffer(pixels, numpy.uint8).reshape(H, W)
good(array)
good(array.copy())
good(numpy.asfortranarray(array.repeat(1)).reshape(H, W))
colour = numpy.zeros((H, W, 3), numpy.uint8)
colour[:, :, 1] = array
good(colour[:, :, 1])
good(numpy.pad(array, ((2, 3), (5, 4)))[2:2 + H, 5:5 + W])
big = numpy.zeros((2 * H, 2 * W), numpy.uint8)
big[::2, ::2] = array
good(big[::2, ::2])
assert bits(detector.detect(array, numpy.arange(W))) == expected
assert bits(detector.detect(array, numpy.arange(W, dtype=numpy.uint8)[::-1])) == expected[::-1]
bad(ValueError, "strides must be positive", detector.detect, array[::-1], [0])
bad(ValueError, "strides must be positive", detector.detect, array[:, ::-1], [0])
bad(ValueError, "rows must not overlap", detector.detect, numpy.asfortranarray(array), [0])
bad(ValueError, "strides must be positive", detector.detect, numpy.broadcast_to(array[0], (H, W)), [0])
bad(ValueError, "of shape", detector.detect, array[:-1], [0])
bad(ValueError, "of shape", detector.detect, array[:, 1:], [0])
bad(ValueError, "of shape", detector.detect, array.ravel(), [0])
bad(ValueError, "of shape", detector.detect, colour, [0])
bad(ValueError, "uint8", detector.detect, array.astype(numpy.float32), [0])
bad(ValueError, "uint8", detector.detect, array.astype(numpy.int8), [0])
bad(TypeError, "", detector.detect, array, numpy.array([0.5]))
