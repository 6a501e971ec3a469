"""Compile a reduced system to CasADi functions and tables."""

from modelica_like.compile.compiled import CompiledDae as CompiledDae
from modelica_like.compile.functions import compile as compile
