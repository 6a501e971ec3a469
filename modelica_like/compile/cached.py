"""What a compiled model and its twins keep, once it is computed: see `CompiledDae.once`, `fast` and `along`."""

from __future__ import annotations

from collections.abc import Hashable
from enum import StrEnum, unique
from typing import TypeAlias


@unique
class Cached(StrEnum):
    """Kinds of what is kept; of some there are several, which the rest of the key tells apart."""

    # -- compile --
    ARGUMENTS = "symbols of the arguments of the functions"
    SYMBOL_PLACES = "number of the argument and row of each of these symbols"
    EDGES = "edges of equations and guards"
    SLIDING = "the model with modes of sliding"
    BUFFERED = "function with fixed buffers, by thread and the key of its values"
    ALONG = "function at many points, by thread and the key of its values"
    # -- start --
    CALLED = "function of the model, by its identity"
    NEWTON = "z after a step of Newton's method"
    RESIDUAL = "residuals of the implicit equations and their Jacobian"
    REGULAR = "whether blocks have a unique solution"
    LINEAR = "whether the implicit equations are linear in z"
    SETTLING = "entries of d that ticks set from anything but themselves"
    MEMORY = "entries of d that ticks set from the motion"
    DRIVING = "entries of d on which the motion depends"
    MOVING = "states on which something depends"
    START_PLAN = "which start values determine what, by the kind of start"
    START_MATRIX = "entries of the matrix of that plan, likewise"
    REGULAR_STARTS = "modes and entries with which this matrix was regular, likewise"
    SLOPES = "partial derivatives, by function, rows, by what, and thread"
    IMPLICIT_SLOPES = "those of the implicit equations, by what, and thread"
    # -- runs --
    FELT = "marks of the entries of d that equations of motion read"
    SCALED = "equations in scaled time and a function for their parameters, by form"
    SCALED_PARAMETERS = "this function alone, likewise"
    IDAS = "integrator, by grid and settings"
    LINEAR_SOLVER = "name of the linear solver of IDAS"
    NATIVE = "model in the run-time, by start, step, chattering and plan"
    NATIVE_STARTS = "kinds of start of which there is such a model"
    INSTANCE = "instance of such a model for single calls, by thread"
    # -- what is read --
    VARIABLES = "all variables"
    ENERGY = "all energy terms"
    TERMS = "the same, densely, in one column; all, or stored energies and their rates only"
    COLUMN = "expressions of all variables or all energy terms, by which of both"
    ROWS = "some of them as a function of what they need, by thread, which of both and rows"
    CURVES = "expressions along a run, by text"
    POWER_WINDOWS = "where powers have edges"
    ROUNDING = "rounding of integrands, by part"
    MOTION = "what time derivatives of variables need"
    RATE = "parts of the time derivative of a variable, by thread and its position"
    POWER_SLOPES = "slopes of the powers"
    ENERGIES = "stored energies, of which slopes are taken"
    ENERGY_CHANGES = "changes of stored energies along changes of states"
    SIGNS = "changes of states in which changes of energies are taken"
    EXPRESSIONS = "the model with more variables, by their expressions"
    # -- derivatives --
    GUARDS = "guards and their rates, with the active ones of each mode"
    REPLAY = "functions of a step, by integrands, stages and which"
    REPLAY_DEPENDENCE = "on what the Jacobian of a step depends"
    BY_PARAMETERS = "Jacobian of values at the start by parameters, by function"
    START_SLOPES = "Jacobians of the start system, by the kind of start"
    KINKS = "kinks of the equations and of integrands, by the text of these"
    KINKS_OF = "kinks of a variable, by path"
    KINK_ARGUMENTS = "arguments of operations with a kink, by the outputs that follow"
    VALUE = "a variable alone, by path"
    SIZES = "equations and values, by the outputs that follow"
    IMPACT = "change of states by an impact, by the motions that stop"
    SHARES = "shares of a reaction as their equations give them, by members"
    PROJECTION = "step of states towards values of variables, by their positions"
    CURVATURE = "stored energy and loss near a point, to second order"


Key: TypeAlias = Cached | tuple[Cached, *tuple[Hashable, ...]]
"""A kind, or with it what tells several of it apart."""
