"""Where the package of the tested program is, exceptions that are expected, and scripts in processes of their own."""
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
PROGRAM = pathlib.Path(sys.argv[sys.argv.index("--program") + 1]).resolve()
PYTHON = str(PROGRAM.parent / "python")
sys.path[:0] = [PYTHON, str(HERE)]


def raised(kind, *words):
    """A context whose body must raise `kind` with all the words in its message."""
    class Expected:
        def __enter__(self):
            return self

        def __exit__(self, found, value, trace):
            assert found is not None, f"nothing was raised, {kind.__name__} expected"
            if not issubclass(found, kind):
                return False
            self.error = value
            missing = [word for word in words if word not in str(value)]
            assert not missing, f"{missing} not in: {value}"
            return True

    return Expected()


def python(code, ranks=1, **more):
    """`code` on so many ranks, beside the networks of the tests."""
    words = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    environment = dict(os.environ, PYTHONPATH=f"{PYTHON}:{HERE}", SCOTCH_PTHREAD_NUMBER="1")
    return subprocess.run([*words, sys.executable, "-c", code], capture_output=True, text=True, **{"env": environment, **more})
