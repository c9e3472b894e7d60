#!/usr/bin/env python3
"""measure.py FILE COMMAND...: runs the command and writes its peak resident memory [bytes] to FILE.RANK."""
import os
import pathlib
import resource
import subprocess
import sys

code = subprocess.run(sys.argv[2:]).returncode
rank = os.environ.get("OMPI_COMM_WORLD_RANK", "0")
peak = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
pathlib.Path(f"{sys.argv[1]}.{rank}").write_text(str(peak))
sys.exit(code if code >= 0 else 128 - code)
