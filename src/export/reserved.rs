//! Names that are taken: exported files of such a name would stand in for others, or would not compile.

/// Keywords of C, C++ and Python. `NAME_detect` would be none, but `NAME` stands alone in Python's `import NAME`, and in
/// the templates and namespaces that people put around it.
const KEYWORDS: &str = "
    alignas alignof and and_eq as asm assert async auto await bitand bitor bool break case catch char char16_t char32_t
    char8_t class co_await co_return co_yield compl concept const const_cast consteval constexpr constinit continue
    decltype def default del delete do double dynamic_cast elif else enum except explicit export extern False false
    finally float for friend from global goto if import in inline int is lambda long mutable namespace new noexcept None
    nonlocal not not_eq nullptr operator or or_eq pass private protected public raise register reinterpret_cast requires
    restrict return short signed sizeof static static_assert static_cast struct switch template this thread_local throw
    True true try typedef typeid typename typeof typeof_unqual union unsigned using virtual void volatile wchar_t while
    with xor xor_eq yield";

/// Modules of Python's standard library, versions 3.8 to 3.14, and those of others that robots' programs import.
/// `NAME.py` on the search path hides them.
const MODULES: &str = "
    abc aifc annotationlib antigravity argparse array ast asynchat asyncio asyncore atexit audioop base64 bdb binascii
    binhex bisect builtins bz2 calendar cgi cgitb chunk cmath cmd code codecs codeop collections colorsys compileall
    compression concurrent configparser contextlib contextvars copy copyreg cprofile crypt csv ctypes curses dataclasses
    datetime dbm decimal difflib dis distutils doctest dummy_threading email encodings ensurepip enum errno faulthandler
    fcntl filecmp fileinput fnmatch formatter fractions ftplib functools gc genericpath getopt getpass gettext glob
    graphlib grp gzip hashlib heapq hmac html http idlelib imaplib imghdr imp importlib inspect io ipaddress itertools
    json keyword lib2to3 linecache locale logging lzma macpath mailbox mailcap marshal math mimetypes mmap modulefinder
    msilib msvcrt multiprocessing netrc nis nntplib nt ntpath nturl2path numbers opcode operator optparse os ossaudiodev
    parser pathlib pdb pickle pickletools pipes pkgutil platform plistlib poplib posix posixpath pprint profile pstats
    pty pwd py_compile pyclbr pydoc pydoc_data pyexpat queue quopri random re readline reprlib resource rlcompleter runpy
    sched secrets select selectors shelve shlex shutil signal site smtpd smtplib sndhdr socket socketserver spwd sqlite3
    sre_compile sre_constants sre_parse ssl stat statistics string stringprep struct subprocess sunau symbol symtable sys
    sysconfig syslog tabnanny tarfile telnetlib tempfile termios textwrap this threading time timeit tkinter token
    tokenize tomllib trace traceback tracemalloc tty turtle turtledemo types typing unicodedata unittest urllib uu uuid
    venv warnings wave weakref webbrowser winreg winsound wsgiref xdrlib xml xmlrpc zipapp zipfile zipimport zlib zoneinfo
    cv2 jax matplotlib numpy onnxruntime pandas picamera2 pil pip pytest rclpy rospy scipy serial setuptools skimage
    sklearn tensorflow tf2_ros torch yaml zmq";

/// Headers of C and of POSIX. `NAME.h` in a folder given by `-I` hides them.
const HEADERS: &str = "
    assert complex ctype errno fenv float inttypes iso646 limits locale math setjmp signal stdalign stdarg stdatomic
    stdbit stdbool stdckdint stddef stdint stdio stdlib stdnoreturn string tgmath threads time uchar wchar wctype
    aio alloca cpio dirent dlfcn elf endian err fcntl features fmtmsg fnmatch ftw getopt glob grp iconv langinfo libgen
    link malloc memory monetary mqueue ndbm netdb nl_types paths poll pthread pwd regex sched search semaphore spawn
    strings stropts syslog tar termios trace ucontext ulimit unistd utime utmpx values wordexp windows winsock2";

/// Libraries that compilers and linkers look for by themselves, or that programs commonly ask for. `libNAME.a` or
/// `libNAME.so` in a folder given by `-L` hides them.
const LIBRARIES: &str = "
    advapi32 anl asan atomic bcrypt bsd c c_nonshared clang_rt crypt crypto cxx dbghelp dl g gcc gcc_eh gcc_s gcov gdi32
    gloss gomp itm kernel32 ld lsan m mingw32 mingwex moldname msvcrt mvec nosys nsl ntdll objc ole32 omp opencv_core
    pthread python3 quadmath resolv rt shell32 ssl ssp stdc supc system tsan ubsan ucrt ucrtbase unwind user32 util uuid
    vcruntime140 winpthread ws2_32 z";

/// What the limits of C's types begin with: the header's `NAME_WIDTH` is the number of a type's bits there.
const TYPES: &str = "
    bitint bool char int int16 int32 int64 int8 int_fast16 int_fast32 int_fast64 int_fast8 int_least16 int_least32
    int_least64 int_least8 intmax intptr llong long ptrdiff schar shrt sig_atomic size uchar uint uint16 uint32 uint64
    uint8 uint_fast16 uint_fast32 uint_fast64 uint_fast8 uint_least16 uint_least32 uint_least64 uint_least8 uintmax
    uintptr ullong ulong ushrt wchar wint";

/// Devices of Windows, where no file can have such a name, whatever its ending.
const DEVICES: &str = "aux con nul prn com0 com1 com2 com3 com4 com5 com6 com7 com8 com9 lpt0 lpt1 lpt2 lpt3 lpt4 lpt5 \
    lpt6 lpt7 lpt8 lpt9";

/// Whose name it is, if it is taken. Some file systems do not tell capitals from small letters, and neither do the
/// names of files here; keywords do.
pub(super) fn owner(name: &str) -> Option<&'static str> {
    let has = |list: &str, name: &str| list.split_ascii_whitespace().any(|word| word == name);
    let small = name.to_ascii_lowercase();
    let library = small.strip_prefix("lib").unwrap_or(&small);
    [
        (has(KEYWORDS, name), "a keyword of C, C++ or Python"),
        (has(MODULES, &small), "a module of Python, which the exported one would hide"),
        (has(HEADERS, &small), "a header of the C library, which the exported one would hide"),
        (has(LIBRARIES, library), "a library that linkers look for, which the exported one would hide"),
        (
            has(TYPES, &small),
            "a type whose number of bits is a macro of C, as the width of the image would be",
        ),
        (has(DEVICES, &small), "a device of Windows, where no file can be called so"),
    ]
    .into_iter()
    .find_map(|(taken, owner)| taken.then_some(owner))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_have_their_owners() {
        for (name, of) in [
            ("class", "keyword"),
            ("co_await", "keyword"),
            ("None", "keyword"),
            ("json", "Python"),
            ("sys", "Python"),
            ("numpy", "Python"),
            ("PIL", "Python"),
            ("cv2", "Python"),
            ("math", "Python"),
            ("stdio", "header"),
            ("Stdint", "header"),
            ("unistd", "header"),
            ("c", "linkers"),
            ("m", "linkers"),
            ("dl", "linkers"),
            ("libc", "linkers"),
            ("libm", "linkers"),
            ("gcc_s", "linkers"),
            ("python3", "linkers"),
            ("kernel32", "linkers"),
            ("size", "macro"),
            ("INT8", "macro"),
            ("aux", "Windows"),
            ("Com1", "Windows"),
        ] {
            assert!(owner(name).is_some_and(|owner| owner.contains(of)), "{name}: {:?}", owner(name));
        }
        for free in [
            "a", "x", "eye", "front", "best", "fmrb", "detector", "sonar", "camera", "lib", "liberty",
            "Class",
        ] {
            assert_eq!(owner(free), None, "{free}");
        }
    }
}
