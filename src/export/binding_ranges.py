
    def state(self, n):
        """What is remembered of n columns from frame to frame: a State that has seen no frame."""
        return State(self, n)

    def ranges(self, image, columns, state=None):
        """The obstacles of a frame and their distances: a list of Range, one for each of the columns.

        image and columns are as for detect. state: of the same columns, from state(n), given again with every frame;
        without one, the frame stands for itself. Only detectors with MEDIAN above 1 use it.
        """
        columns = _columns(columns)
        n = len(columns)
        if state is None:
            state = State(self, n)
        if not isinstance(state, State):
            raise TypeError("a state is what state(n) of this module's detector gives, not %s" % type(state).__name__)
        if state.n != n:
            raise ValueError("the state is of %d columns, not %d" % (state.n, n))
        address, row, pixel, alive = _frame(image)
        ranges = (_Range * n)()
        _check(self._ranges(address, row, pixel, columns, n, state.floats, ranges))
        del alive
        return [
            Range(r.row, r.bearing, r.distance, r.nearest, r.farthest, r.status) for r in ranges]


OBSTACLE, NONE_IN_VIEW, INVALID = 0, 1, 2

Range = collections.namedtuple("Range", "row bearing distance nearest farthest status")
Range.__doc__ = """What is known of a column. Lengths in metres, along the floor from the point below the lens.

row: the row believed, in pixels from the top (with MEDIAN 3 the median of three frames); bearing: direction in
radians, positive to the left; distance: to the obstacle, inf if there is none in view, nan if invalid; nearest and
farthest: the distance if the obstacle stood one row lower or higher; status: OBSTACLE, NONE_IN_VIEW or INVALID.
"""


class _Range(ctypes.Structure):
    _fields_ = [(name, ctypes.c_float) for name in Range._fields[:5]] + [("status", ctypes.c_int32)]


class State:
    """What is remembered of some columns from frame to frame. One frame at a time may use it."""

    def __init__(self, detector, n):
        self._n = operator.index(n)
        if self._n < 0:
            raise ValueError("a state is of 0 columns or more, not %d" % self._n)
        self._detector = detector
        self._floats = (ctypes.c_float * (2 * self._n if MEDIAN > 1 else 1))()
        self.reset()

    @property
    def n(self):
        """The number of columns."""
        return self._n

    @property
    def floats(self):
        """What the library keeps in it."""
        return self._floats

    def reset(self):
        """Forgets the frames seen: to be called when the robot has been moved."""
        self._detector._reset(self.floats, self.n)
