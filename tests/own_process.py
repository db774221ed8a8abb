"""Python in a process of its own whose memory is counted from nothing.

Linux counts towards a program's largest memory what the process that forked it held; a shell in between
holds little.
"""

from __future__ import annotations

import subprocess
import sys

BETWEEN = ("/bin/sh", "-c", '"$@"; exit $?', "sh", sys.executable)


def run_python(*arguments: object, check: bool = False) -> subprocess.CompletedProcess[str]:
    """As `subprocess.run` of the interpreter with `arguments`, its output captured as text."""
    command = [*BETWEEN, *(str(argument) for argument in arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=check)
