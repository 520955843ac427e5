"""Checks the binding det.py beside this file, which was exported without a camera."""

import copy
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
sys.dont_write_bytecode = True
import det  # noqa: E402

detector = det.Detector()
assert not det.HAS_RANGES and len(detector.detect(bytes(det.WIDTH * det.HEIGHT), [0, 1])) == 2


def missing(owner, name, remedy):
    assert not hasattr(owner, name)
    try:
        getattr(owner, name)
    except AttributeError as fault:
        assert name in str(fault) and ("--camera" in str(fault)) == remedy, fault
    else:
        raise AssertionError(name)


for name in ("state", "ranges"):
    missing(detector, name, True)
for name in ("State", "Range", "OBSTACLE", "NONE_IN_VIEW", "INVALID"):
    missing(det, name, True)
missing(detector, "stat", False)
missing(det, "Stat", False)
assert copy.copy(detector).detect(bytes(det.WIDTH * det.HEIGHT), [0]) == detector.detect(bytes(det.WIDTH * det.HEIGHT), [0])
