"""Flatten a component tree: paths, connection sets, equations with their origin."""

from modelica_like.flatten.flatten import flatten as flatten
from modelica_like.flatten.model import FlatModel as FlatModel
