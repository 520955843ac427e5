"""Runs an exported detector on frames from standard input, and prints what it sees: a line of JSON for each frame.

    vsonar export best.gp --name detector --out detector --camera camera.toml --median 3
    ffmpeg -i drive.mp4 -vf scale=320:240 -pix_fmt gray -f rawvideo - | python3 sonar.py detector 12

The arguments are the folder of the export and the number of columns, spread evenly over the image. The frames are raw
gray pixels or Y4M, of the detector's size. The lines are those of sonar.c, to the byte; see there what they mean.
"""

import math
import sys

try:
    import numpy
except ImportError:  # The detector takes plain bytes as well.
    numpy = None


STATUS = ("obstacle", "none-in-view", "invalid")  # by detector.OBSTACLE and so on


def fail(message, code=1):
    print("error: " + message, file=sys.stderr)
    sys.exit(code)


def y4m_line(stream, number):
    """The rest of a header's line, without its end."""
    line = stream.readline(1024)
    if not line.endswith(b"\n"):
        fail("frame %d: the input ends in a header of Y4M, or this is none" % number)
    return line[:-1].decode("ascii", "replace")


def chroma_bytes(header, width, height):
    """Bytes of colour that follow each frame's luma, from the header of Y4M."""
    words = {word[0]: word[1:] for word in header.split()}
    if (words.get("W"), words.get("H")) != (str(width), str(height)):
        fail("the frames are of %s x %s pixels, but the detector is for %d x %d: scale them"
             % (words.get("W"), words.get("H"), width, height))
    form = words.get("C", "420")
    half_width, half_height = (width + 1) // 2, (height + 1) // 2
    sizes = {"mono": 0, "422": 2 * half_width * height, "444": 2 * width * height}
    for kind in ("420", "420jpeg", "420mpeg2", "420paldv"):
        sizes[kind] = 2 * half_width * half_height
    if form not in sizes:
        fail("Y4M of the form C%s: convert it to Cmono, C420, C422 or C444, of 8 bits" % form)
    return sizes[form]


def frames(stream, width, height):
    """The frames, each as bytes, row by row."""
    magic = b"YUV4MPEG2 "
    begin = stream.read(len(magic))
    is_y4m = begin == magic
    chroma = 0
    if is_y4m:
        chroma = chroma_bytes(y4m_line(stream, 0), width, height)
        begin = b""
    number = 0
    while True:
        if is_y4m:
            word = stream.read(5)
            if not word:
                return
            if word != b"FRAME":
                fail("frame %d: this is not where a frame of Y4M begins" % number)
            y4m_line(stream, number)
        pixels = begin + stream.read(width * height - len(begin))
        begin = b""
        if not pixels and not is_y4m:
            return
        if len(pixels) < width * height:
            fail("frame %d: the input ends before its last pixel" % number)
        if len(stream.read(chroma)) < chroma:
            fail("frame %d: the input ends before its last colour" % number)
        yield pixels
        number += 1


def array(name, values):
    """Numbers in JSON, which has neither infinity nor NaN. Nine digits give a binary32 number back exactly."""
    return ', "%s": [%s]' % (name, ", ".join("%.9g" % v if math.isfinite(v) else "null" for v in values))


def main():
    if not 2 <= len(sys.argv) <= 3:
        print("usage: sonar.py EXPORT [COLUMNS] < FRAMES", file=sys.stderr)
        sys.exit(2)
    # The exported module, which loads the shared library beside it.
    sys.path.insert(0, sys.argv[1])
    try:
        import detector
        sonar = detector.Detector()
    except (ImportError, AttributeError, OSError, ValueError) as error:
        fail("%s is no export named detector: %s" % (sys.argv[1], error), 2)
    width, height = sonar.width, sonar.height
    text = sys.argv[2] if len(sys.argv) == 3 else "12"
    if not (text.isdecimal() and 1 <= int(text) <= width):
        fail("the number of columns has to be 1 to %d, not '%s'" % (width, text), 2)
    n = int(text)
    # The image is cut into n strips of one width; the column in the middle of each is looked at.
    columns = [(2 * i + 1) * width // (2 * n) for i in range(n)]
    state = sonar.state(n) if detector.HAS_RANGES else None

    seen = 0
    for pixels in frames(sys.stdin.buffer, width, height):
        # An array of NumPy is taken as it is, also as a view into a larger one; so are plain bytes.
        image = numpy.frombuffer(pixels, numpy.uint8).reshape(height, width) if numpy else pixels
        line = '{"frame": %d, "columns": [%s]' % (seen, ", ".join(map(str, columns)))
        if detector.HAS_RANGES:
            ranges = sonar.ranges(image, columns, state)
            line += array("rows", [r.row for r in ranges])
            for name in ("bearing", "distance", "nearest", "farthest"):
                line += array(name, [getattr(r, name) for r in ranges])
            line += ', "status": [%s]' % ", ".join('"%s"' % STATUS[r.status] for r in ranges)
        else:
            line += array("rows", sonar.detect(image, columns))
        print(line + "}", flush=True)
        seen += 1
    if seen == 0:
        fail("there is no frame on standard input")


if __name__ == "__main__":
    main()
