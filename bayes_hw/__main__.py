"""`python -m bayes_hw` is the command `bayes-hw`."""

from bayes_hw.cli import main

raise SystemExit(main())
