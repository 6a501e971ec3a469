"""Units and quantities."""

from modelica_like.language.units.atoms import BASE as BASE
from modelica_like.language.units.quantity import in_unit as in_unit
from modelica_like.language.units.quantity import plain_digits as plain_digits
from modelica_like.language.units.quantity import read_quantity as read_quantity
from modelica_like.language.units.quantity import to_si as to_si
from modelica_like.language.units.unit import ANY as ANY
from modelica_like.language.units.unit import ONE as ONE
from modelica_like.language.units.unit import Unit as Unit
from modelica_like.language.units.unit import coherent as coherent
from modelica_like.language.units.unit import parse_unit as parse_unit
from modelica_like.language.units.unit import same_dimension as same_dimension
