"""Starting a tool: an interpreter that has the modules it needs, and errors that end in one line.

Needs the standard library alone, so that it works where numpy is missing.
"""
import ctypes
import importlib
import os
import signal
import sys

PACKAGES = {"numpy": "python3-numpy", "h5py": "python3-h5py", "matplotlib": "python3-matplotlib",
            "meshio": "python3-meshio", "tqdm": "python3-tqdm", "scipy": "python3-scipy", "PIL": "python3-pil"}
SYSTEM_PYTHON = "/usr/bin/python3"


def missing_modules(names):
    """The names among `names` that this interpreter cannot import."""
    missing = []
    for name in names:
        try:
            importlib.import_module(name)
        except ImportError:
            missing.append(name)
    return missing


def require(*names):
    """Returns if every module imports; else starts the script once more under /usr/bin/python3; else says what to
    install and exits with 2."""
    missing = missing_modules(names)
    tried = os.environ.pop("BACKSPRING_REEXEC", "") == "1"
    if not missing:
        return
    if not tried and os.access(SYSTEM_PYTHON, os.X_OK) and sys.executable != SYSTEM_PYTHON:
        os.environ["BACKSPRING_REEXEC"] = "1"
        sys.stdout.flush()
        os.execv(SYSTEM_PYTHON, [SYSTEM_PYTHON] + sys.argv)
    packages = " ".join(PACKAGES.get(name, "python3-" + name) for name in missing)
    tool = os.path.basename(sys.argv[0])
    print(f"{tool}: {sys.executable} has no {', '.join(missing)}; install with: sudo apt-get install {packages}",
          file=sys.stderr)
    sys.exit(2)


def _is_hdf5(path):
    try:
        with open(path, "rb") as file:
            return file.read(4) == b"\x89HDF"
    except OSError:
        return False


def _in_a_child(tool):
    """Goes on in a child, so that a crash of libhdf5, which damaged files can bring about, ends in one line; the parent waits and exits as the child does."""
    sys.stdout.flush()
    child = os.fork()
    if child == 0:
        ctypes.CDLL(None).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG: not to outlive the parent
        return
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the terminal sends it to both
    signal.signal(signal.SIGTERM, lambda *_: os.kill(child, signal.SIGTERM))
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code in (-signal.SIGSEGV, -signal.SIGABRT, -signal.SIGBUS, -signal.SIGFPE):
        read = [a for a in sys.argv[1:] if _is_hdf5(a)]
        print(f"{tool}: libhdf5 crashed: {' or '.join(read) or 'a file'} is damaged", file=sys.stderr)
        code = 2
    os._exit(code if code >= 0 else 128 - code)


def run(main, user_error, apart=True):
    """Calls main(); `user_error` ends in one line and exit code 2, a failure of the disk in one line and 4. apart: in a process of its own."""
    tool = os.path.basename(sys.argv[0])
    if apart:
        _in_a_child(tool)
    try:
        sys.exit(main() or 0)
    except user_error as error:
        print(f"{tool}: {error}", file=sys.stderr)
        sys.exit(2)
    except BrokenPipeError:  # `tool | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(0)
    except MemoryError:
        print(f"{tool}: not enough memory{_while_reading()}", file=sys.stderr)
        sys.exit(2)
    except OSError as error:
        if _reading_hdf5(error):
            _damaged(tool, error)
        where = f"{error.filename}: " if error.filename else ""
        print(f"{tool}: {where}{error.strerror or error}", file=sys.stderr)
        sys.exit(4)
    except KeyboardInterrupt:
        print(f"{tool}: stopped", file=sys.stderr)
        sys.exit(130)
    except Exception as error:
        if not _reading_hdf5(error):
            raise
        _damaged(tool, error)


def _reading_hdf5(error):
    """Whether h5py raised this while it read."""
    at = error.__traceback__
    while at.tb_next:
        at = at.tb_next
    inside = at.tb_frame.f_globals.get("__name__", "").startswith("h5py") or at.tb_frame.f_code.co_filename.startswith("h5py")
    return inside and not any(word in str(error) for word in ("write", "create", "flush"))


def _while_reading():
    module = sys.modules.get("open_hdf5")
    return f", reading {module.last_opened}" if module and module.last_opened else ""


def _damaged(tool, error):
    reason = (str(error).splitlines() or [type(error).__name__])[0]
    print(f"{tool}: a file is damaged ({reason}){_while_reading()}", file=sys.stderr)
    sys.exit(2)
