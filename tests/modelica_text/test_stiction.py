"""Frictions of Modelica text that stick together on one shaft, against closed forms."""

from pathlib import Path

import pytest

from modelica_like import export_fmu, run_fmu, simulate
from modelica_like.errors import FmuFailed, SingularAtStart
from modelica_like.netlist.modelica.read import read_modelica

FRICTION = """
  connector Flange
    Real phi;
    flow Real tau;
  end Flange;
  model Rubbing "Coulomb friction, as the standard library writes it"
    Flange a;
    Flange b;
    parameter Real limit = 1;
    parameter Real peak = 1;
    parameter Real steps = 1 "A gear between its ends";
    Real w(start = 0);
    Real load;
    Real slip;
    Real limits = limit*peak;
    Boolean forward(start = false, fixed = true);
    Boolean backward(start = false, fixed = true);
    Boolean locked;
    Integer mode(start = 3, fixed = true);
  equation
    a.phi = steps*b.phi;
    w = der(a.phi);
    slip = der(w);
    forward = pre(mode) == 0 and (load > limits or pre(forward) and load > limit) or initial() and w > 0;
    backward = pre(mode) == 0 and (load < -limits or pre(backward) and load < -limit) or initial() and w < 0;
    locked = not (pre(mode) == 1 or forward or pre(mode) == -1 or backward);
    slip = if locked then 0 else if forward then load - limits else if backward then load + limits
      else if pre(mode) == 1 then load - limits else if pre(mode) == -1 then load + limits
      else load - sign(w)*limits;
    0 = b.tau + steps*(a.tau - (if locked then load else if forward or pre(mode) == 1 then limit else -limit));
    mode = if (pre(mode) == 1 or forward) and w > 0 then 1 else if (pre(mode) == -1 or backward) and w < 0 then -1
      else 0;
  end Rubbing;
  model Spring
    Flange a;
    Flange b;
  equation
    a.tau = 10*(a.phi - b.phi);
    b.tau = -a.tau;
  end Spring;
  model Shaft
    Flange a;
    parameter Real J = 2;
    parameter Real rate = 0;
    parameter Real most = 1e9;
    Real w(start = 0, fixed = true);
  equation
    w = der(a.phi);
    J*der(w) = a.tau + min(rate*time, most);
  end Shaft;
"""


def drive(folder: Path, parts: str, joints: str) -> object:
    """Read a model of rubbing parts; `shaft` is pushed by a torque that rises."""
    text = f"package P{FRICTION}model Drive\n{parts}\nequation\n{joints}\nend Drive;\nend P;\n"
    (folder / "P.mo").write_text(text)
    return read_modelica(folder / "P.mo", "P.Drive")[0]


TWO = (
    "Shaft shaft(rate = 3); Rubbing one(limit = 2); Rubbing two(limit = 4);",
    "connect(shaft.a, one.a); connect(one.b, two.a);",
)
PEAK = (
    "Shaft shaft(rate = 3); Rubbing one(limit = 2, peak = 1.5, steps = 2); Rubbing two(limit = 4); Rubbing three;",
    "connect(shaft.a, one.a); connect(one.b, two.a); connect(two.b, three.a);",
)
STANDS = (
    "Shaft shaft(rate = 3, most = 5.9); Rubbing one(limit = 2); Rubbing two(limit = 4);",
    "connect(shaft.a, one.a); connect(one.b, two.a);",
)


@pytest.mark.parametrize("solver", ["idas", "native"])
@pytest.mark.parametrize(
    ("parts", "begins", "slides"),
    [(TWO, 6, 6), (PEAK, 3 + 5 / 2, 2 + 5 / 2), (STANDS, None, 6)],
    ids=["two", "behind a gear, with a peak", "both hold"],
)
def test_a_shaft_breaks_away_at_the_sum_of_its_limits(tmp_path, parts, begins, slides, solver) -> None:
    """At `begins` N.m it breaks away, and slides against `slides` N.m: J w' = 3 t - slides."""
    run = simulate(drive(tmp_path, *parts), 3.0, solver=solver, rtol=1e-9)
    if begins is None:
        assert abs(run.final["shaft.w"]) < 1e-10
        return
    begin = begins / 3
    wanted = (1.5 * (9 - begin**2) - slides * (3 - begin)) / 2
    assert run.final["shaft.w"] == pytest.approx(wanted, rel=1e-7)


FALLING = "Shaft shaft(rate = 3); Rubbing one(limit = 2, peak = 1.5, steps = 2); Rubbing two(limit = 3, peak = 1.5);"


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_two_limits_that_fall_last_until_their_shaft_moves(tmp_path, solver) -> None:
    """It breaks away at 3 + 4.5 N.m, and slides against 5 N.m."""
    model = drive(tmp_path, FALLING, "connect(shaft.a, one.a); connect(shaft.a, two.a);")
    run = simulate(model, 3.0, solver=solver, rtol=1e-9)
    assert run.final["shaft.w"] == pytest.approx((1.5 * (9 - 2.5**2) - 5 * 0.5) / 2, rel=1e-7)


@pytest.mark.parametrize("solver", ["idas", "native"])
def test_behind_a_gear_it_is_open_which_of_them_falls_first(tmp_path, solver) -> None:
    model = drive(tmp_path, FALLING, "connect(shaft.a, one.a); connect(one.b, two.a);")
    with pytest.raises(SingularAtStart) as caught:
        simulate(model, 3.0, solver=solver)
    place = caught.value.where[0]
    assert (
        str(caught.value)
        == f"""Which of one and two slides first at t = 0 s is open.
  in P.mo:{place.line} `slip = if locked then 0 else if forward then load - limits else if backward then load + limits`
They stick on shafts that turn at different speeds, and the limit of each falls once it slides.
Let the limit of one stay (peak = 1), or put a spring between them."""
    )


def test_an_fmu_says_so(tmp_path) -> None:
    model = drive(tmp_path, FALLING, "connect(shaft.a, one.a); connect(one.b, two.a);")
    export_fmu(model, tmp_path / "open.fmu", check=False)
    with pytest.raises(FmuFailed, match=r"in the equations for one and two, where it is open which slides first\."):
        run_fmu(tmp_path / "open.fmu", stop=3.0)


def test_an_fmu_does_so_too(tmp_path) -> None:
    export_fmu(drive(tmp_path, *TWO), tmp_path / "two.fmu")
    run = run_fmu(tmp_path / "two.fmu", stop=3.0, outputs=["shaft.w"])
    assert run["shaft.w"][-1] == pytest.approx(0.75 * (3.0 - 2.0) ** 2, rel=1e-5)


def test_what_one_alone_holds_does_not_yield(tmp_path) -> None:
    """Behind a spring each has its own shaft: nothing is left open, and what is locked stands."""
    parts = "Shaft shaft(rate = 3, most = 1.5); Shaft far; Rubbing one(limit = 2); Rubbing two(limit = 4); Spring c;"
    joints = "connect(shaft.a, one.a); connect(far.a, two.a); connect(one.b, c.a); connect(two.b, c.b);"
    run = simulate(drive(tmp_path, parts, joints), 3.0)
    assert run.final["shaft.w"] == 0.0
    assert run.final["far.w"] == 0.0
