"""A page in which a drive is built, changed and run: its text, picture, values and curves are views of one file."""

from modelica_like.page.server import PageServer, explore
from modelica_like.page.session import Session, new_file

__all__ = ["PageServer", "Session", "explore", "new_file"]
