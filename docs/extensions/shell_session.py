"""The directive `session`: command lines that are run while the page is built, each with what it prints.

    ```{session} NAME
    $ bayes-hw demo --out demo/
    ```

Sessions of one NAME share a folder that starts empty, so that a page goes on where it stopped. `bayes-hw` and
`python` are those of the build, `$PAGES` is the folder of the page; a command that fails ends the build, but
where its line starts with `$! `.
Options: `:lines: N` shows the last N lines of each output; `:hide:` runs and shows nothing.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from docutils import nodes
from docutils.parsers.rst import directives
from sphinx.application import Sphinx
from sphinx.errors import SphinxError
from sphinx.util.docutils import SphinxDirective

SECONDS = 600
ELAPSED = re.compile(r"^.*: \d+\.\d s\n", re.MULTILINE)
"""How long a stage took: not the same twice."""


class FailedCommandError(SphinxError):
    """A command of a page did not do what the page says."""


class SessionDirective(SphinxDirective):
    """Runs its lines and shows them with what they print."""

    required_arguments = 1
    has_content = True
    option_spec = {"lines": directives.positive_int, "hide": directives.flag}  # noqa: RUF012

    def run(self) -> list[nodes.Node]:
        folder = sessions(self.env.app) / self.arguments[0]
        folder.mkdir(parents=True, exist_ok=True)
        shown = [self.one(line, folder) for line in self.content if line.strip()]
        if "hide" in self.options:
            return []
        text = "\n".join(shown)
        block = nodes.literal_block(text, text)
        block["language"] = "console"
        return [block]

    def one(self, line: str, folder: Path) -> str:
        """Run one line in `folder`; the line and its output, or the last lines of it."""
        fails, command = line.startswith("$! "), line.removeprefix("$! ").removeprefix("$ ")
        done = subprocess.run(
            command,
            shell=True,
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=SECONDS,
            env=environment(Path(self.env.doc2path(self.env.docname)).parent),
        )
        if (done.returncode != 0) != fails:
            raise FailedCommandError(
                f"{self.env.docname}: {command!r} ended with {done.returncode}:\n{done.stdout}"
            )
        lines = ELAPSED.sub("", done.stdout).rstrip().splitlines()
        if wanted := self.options.get("lines"):
            lines = lines[-wanted:]
        return "\n".join([f"$ {command}", *lines])


def environment(page: Path) -> dict[str, str]:
    """That of a command: the programs of the build first, and the folder of the page."""
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    return os.environ | {"PATH": path, "PAGES": str(page), "COLUMNS": "100"}


def sessions(app: Sphinx) -> Path:
    """Where the folders of all sessions are, beside what is built."""
    return Path(app.srcdir) / "_build" / "sessions"


def start_empty(app: Sphinx) -> None:
    """Remove what the sessions of an earlier build left."""
    shutil.rmtree(sessions(app), ignore_errors=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("session", SessionDirective)
    app.connect("builder-inited", start_empty)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
