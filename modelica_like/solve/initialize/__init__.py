"""Points of the solution: what start values determine, what modes hold and share, derivatives, and their messages."""

from __future__ import annotations

from modelica_like.solve.initialize.contradictions import not_found as not_found
from modelica_like.solve.initialize.contradictions import not_met as not_met
from modelica_like.solve.initialize.contradictions import same_motion as same_motion
from modelica_like.solve.initialize.holds import INSTANT as INSTANT
from modelica_like.solve.initialize.holds import Impact as Impact
from modelica_like.solve.initialize.holds import holding as holding
from modelica_like.solve.initialize.holds import sharing as sharing
from modelica_like.solve.initialize.ideal import contradiction as contradiction
from modelica_like.solve.initialize.ideal import no_valid_modes as no_valid_modes
from modelica_like.solve.initialize.ideal import refuse_contradiction as refuse_contradiction
from modelica_like.solve.initialize.plan import StartKind as StartKind
from modelica_like.solve.initialize.plan import StartPlan as StartPlan
from modelica_like.solve.initialize.plan import start_plan as start_plan
from modelica_like.solve.initialize.point import Point as Point
from modelica_like.solve.initialize.point import call as call
from modelica_like.solve.initialize.point import check_singular as check_singular
from modelica_like.solve.initialize.point import implicit_at as implicit_at
from modelica_like.solve.initialize.point import is_linear as is_linear
from modelica_like.solve.initialize.point import newton_at as newton_at
from modelica_like.solve.initialize.point import not_solved as not_solved
from modelica_like.solve.initialize.point import polished as polished
from modelica_like.solve.initialize.point import rate_not_finite as rate_not_finite
from modelica_like.solve.initialize.point import solve_implicit as solve_implicit
from modelica_like.solve.initialize.singular import implicit_singular as implicit_singular
from modelica_like.solve.initialize.singular import singular_block as singular_block
from modelica_like.solve.initialize.slopes import variable_slopes as variable_slopes
from modelica_like.solve.initialize.steady import memory_not_steady as memory_not_steady
from modelica_like.solve.initialize.steady import mode_not_steady as mode_not_steady
from modelica_like.solve.initialize.steady import not_steady as not_steady
from modelica_like.solve.initialize.steady import unsettled as unsettled
