
    def __getattr__(self, name):
        raise _absent("Detector." + name) if name in ("ranges", "state") else AttributeError(
            "'Detector' object has no attribute %r" % name)


def _absent(name):
    return AttributeError(
        "@NAME@ has no %s: it was exported without a camera, so it gives rows but no distances; export it again "
        "with `vsonar export ... --camera camera.toml`" % name)


def __getattr__(name):
    if name in ("OBSTACLE", "NONE_IN_VIEW", "INVALID", "Range", "State"):
        raise _absent(name)
    raise AttributeError("module %r has no attribute %r" % (__name__, name))
