"""`python -m modelica_like` is the command line."""

from modelica_like.cli import main

main()
