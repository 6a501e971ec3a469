"""Structure: aliases, index reduction, state selection, blocks."""

from modelica_like.structure.reduce import ReducedDae as ReducedDae
from modelica_like.structure.reduce import reduce as reduce
