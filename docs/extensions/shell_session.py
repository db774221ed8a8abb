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
PROGRAMS = {"bayes-hw": f"{sys.executable} -m bayes_hw", "python": sys.executable}
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
        folder = Path(self.env.doctreedir).parent / "sessions" / self.arguments[0]
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
        name, space, rest = command.partition(" ")
        done = subprocess.run(
            PROGRAMS.get(name, name) + space + rest,
            shell=True,
            cwd=folder,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=SECONDS,
            env=os.environ
            | {"COLUMNS": "100", "PAGES": str(Path(self.env.doc2path(self.env.docname)).parent)},
        )
        if (done.returncode != 0) != fails:
            raise FailedCommandError(
                f"{self.env.docname}: {command!r} ended with {done.returncode}:\n{done.stdout}"
            )
        lines = ELAPSED.sub("", done.stdout).rstrip().splitlines()
        if wanted := self.options.get("lines"):
            lines = lines[-wanted:]
        return "\n".join([f"$ {command}", *lines])


def start_empty(app: Sphinx) -> None:
    """Remove what the sessions of an earlier build left."""
    shutil.rmtree(Path(app.doctreedir).parent / "sessions", ignore_errors=True)


def setup(app: Sphinx) -> dict[str, bool]:
    """Register the directive."""
    app.add_directive("session", SessionDirective)
    app.connect("builder-inited", start_empty)
    return {"parallel_read_safe": False, "parallel_write_safe": True}
