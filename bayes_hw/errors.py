"""The one exception that a user's input may raise."""

from __future__ import annotations


class InputError(ValueError):
    """An input that cannot be used.

    The message is one line that names the file, the row or key, and the remedy; the command line prints
    it on stderr and ends with exit status 2.
    """
