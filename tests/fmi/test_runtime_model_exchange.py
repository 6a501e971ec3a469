"""Model Exchange: right hand side, events and derivatives as in Python, under FMPy's own integrators."""

import ctypes

import casadi as ca
import numpy as np
import pytest
from fmpy import simulate_fmu

from modelica_like import export_fmu, simulate
from modelica_like.native.start import initialize

DRIVES = [
    "msl/rotational/CoupledClutches.toml",
    "msl/rotational/LossyGearDemo1.toml",
    "ravigneaux.toml",
    "dc_bench.toml",
]


def vector(function, fmu, count):
    values = (ctypes.c_double * count)()
    function(fmu.component, values, count)
    return np.array(values)


def continuous(case, **values):
    """An instance in continuous-time mode, events of the start behind it."""
    fmu = case.started("me", **values)
    events(fmu)
    fmu.enterContinuousTimeMode()
    return fmu


def events(fmu):
    info = fmu.newDiscreteStates()
    return info[4] if info[3] else np.inf


@pytest.mark.parametrize("netlist", DRIVES)
def test_the_start_is_that_of_a_simulation(exported, netlist):
    case = exported(netlist)
    fmu = case.started("me")
    point = initialize(case.model, start=case.model.settings.get("start", "given"))
    found = vector(fmu.fmi2GetContinuousStates, fmu, len(point.x))
    assert found == pytest.approx(point.x, rel=1e-12, abs=1e-13)
    model = case.model
    rates = model.equations.ode(point.t, point.x, point.z, model.p, model.u, point.d).full().ravel()
    assert vector(fmu.fmi2GetDerivatives, fmu, len(point.x)) == pytest.approx(rates, rel=1e-9, abs=1e-9)
    modes = [one.path for one in model.flat_discretes if one.names]
    numbers = [int(point.d[k]) for k, one in enumerate(model.flat_discretes) if one.names]
    assert fmu.getInteger([case.ref(path) for path in modes]) == numbers


def integrate(case, until, step):
    """Explicit Euler with steps that end at time events; state events at the end of the step in which they happen."""
    fmu = case.started("me", until=until)
    size = len(case.model.states)
    moment, time = events(fmu), 0.0
    fmu.enterContinuousTimeMode()
    while time < until:
        end = min(time + step, moment, until)
        x = vector(fmu.fmi2GetContinuousStates, fmu, size)
        x += (end - time) * vector(fmu.fmi2GetDerivatives, fmu, size)
        time = end
        fmu.setTime(time)
        fmu.fmi2SetContinuousStates(fmu.component, (ctypes.c_double * size)(*x), size)
        if fmu.completedIntegratorStep()[0] or time >= moment:
            fmu.enterEventMode()
            moment = events(fmu)
            fmu.enterContinuousTimeMode()
    return vector(fmu.fmi2GetContinuousStates, fmu, size)


def test_euler_converges_to_idas(exported):
    case = exported("msl/rotational/CoupledClutches.toml")
    reference = simulate(case.model, 0.6, rtol=1e-10, atol=1e-12)
    exact = np.array([reference.final[name] for name in case.model.states])
    errors = [np.max(np.abs(integrate(case, 0.6, step) - exact)) for step in (2e-4, 1e-4)]
    assert errors[1] < 0.6 * errors[0]
    assert errors[1] < 0.02


def test_indicators_are_below_zero_after_every_event(exported):
    case = exported("msl/rotational/CoupledClutches.toml")
    fmu = continuous(case)
    indicators = vector(fmu.fmi2GetEventIndicators, fmu, case.model.events.guards.numel_out(0))
    assert np.all(indicators < 0)
    assert not fmu.completedIntegratorStep()[0]


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_a_switch_is_a_change_of_states_for_the_importer(exported, version):
    """It would not restart its solver otherwise; without a switch it need not."""
    fmu = exported("dc_bench.toml", version).started("me")
    update = fmu.newDiscreteStates if version == "2.0" else fmu.updateDiscreteStates
    _, _, _, _, scheduled, moment = update()
    assert scheduled
    fmu.setTime(moment)
    assert [update()[3] for _ in range(2)] == [True, False]


def test_an_indicator_above_zero_is_an_event(exported):
    case = exported("msl/rotational/CoupledClutches.toml")
    fmu = continuous(case)
    x = vector(fmu.fmi2GetContinuousStates, fmu, len(case.model.states))
    x[case.model.states.index("clutch2.w_rel")] = -5.0
    fmu.fmi2SetContinuousStates(fmu.component, (ctypes.c_double * len(x))(*x), len(x))
    indicators = vector(fmu.fmi2GetEventIndicators, fmu, case.model.events.guards.numel_out(0))
    assert bool(np.any(indicators > 0)) == bool(fmu.completedIntegratorStep()[0])


@pytest.mark.parametrize("version", ["2.0", "3.0"])
def test_fmpy_with_cvode_gives_the_trajectory_of_idas(version, tmp_path, example):
    path = export_fmu(example, tmp_path / "drive.fmu", version=version, check=False).path
    reference = simulate(example, 1.5, rtol=1e-10, atol=1e-12)
    names = list(reference.model.states)
    run = simulate_fmu(
        str(path), fmi_type="ModelExchange", solver="CVode", relative_tolerance=1e-8, stop_time=1.5, output=names,
        output_interval=0.05,
    )  # fmt: skip
    for row in run:
        exact = reference.at(min(float(row["time"]), 1.5))
        assert [row[name] for name in names] == pytest.approx([exact[name] for name in names], rel=2e-5, abs=2e-5)


# -- derivatives -----------------------------------------------------------------------------------------------------


def known_and_unknown(case):
    names = [name for name in case.model.states if name in case.face.by_name]
    parameters = [one.path for one in case.model.flat_parameters if one.tunable][:8]
    locals_ = [one.name for one in case.face.variables if one.slot[0] == "variable"]
    known = [case.ref(name) for name in [*names, *parameters]]
    unknown = [*case.face.derivatives, *(case.ref(name) for name in locals_)]
    return known, [k for k in dict.fromkeys(unknown) if case.face.variables[k].slot[0] in ("der", "variable")]


def exact_jacobian(case, fmu, known, unknown):
    """Total derivatives by CasADi's symbolic differentiation, z following."""
    model, a = case.model, case.model.arguments
    everything = list(a.values())
    point = [ca.DM(v) for v in values_at(case, fmu)]
    slots = {"state": "x", "parameter": "p"}
    known_slots = [case.face.variables[k].slot for k in known]
    by = ca.vertcat(*(a[slots[kind]][index] for kind, index in known_slots))
    unknown_slots = [case.face.variables[k].slot for k in unknown]
    rates, variables = model.equations.ode(*everything), model.equations.variables(*everything)
    rows = ca.vertcat(*(rates[k] if kind == "der" else variables[k] for kind, k in unknown_slots))
    alg = model.equations.alg(*everything)
    parts = ca.Function(
        "parts",
        everything,
        [ca.jacobian(rows, by), ca.jacobian(rows, a["z"]), ca.jacobian(alg, a["z"]), ca.jacobian(alg, by)],
    )(*point)
    direct, by_z, alg_z, alg_by = (part.full() for part in parts)
    return direct - by_z @ np.linalg.solve(alg_z, alg_by) if model.implicit else direct


def values_at(case, fmu):
    from modelica_like.native.holds import share
    from modelica_like.solve.initialize import Point, solve_implicit

    model = case.model
    x = vector(fmu.fmi2GetContinuousStates, fmu, len(model.states))
    references = [one.reference for one in case.face.variables if one.slot[0] == "discrete"]
    d = np.zeros(model.discrete_size)
    for k in references:
        one = case.face.variables[k]
        d[one.slot[1]] = (fmu.getInteger if one.modes else fmu.getReal)([k])[0]
    point = Point(0.0, x, model.starts.z_guesses.copy(), d)
    share(model, point)
    solve_implicit(model, point)
    return [0.0, point.x, point.z, model.p, model.u, point.d]


@pytest.mark.parametrize("netlist", [DRIVES[0], DRIVES[1], DRIVES[3]])
def test_derivatives_in_both_directions_are_exact(exported, netlist):
    case = exported(netlist)
    fmu = continuous(case)
    known, unknown = known_and_unknown(case)
    exact = exact_jacobian(case, fmu, known, unknown)
    columns = [fmu.getDirectionalDerivative(unknown, [k], [1.0]) for k in known]
    scale = 1.0 + np.abs(exact)
    assert np.max(np.abs(np.array(columns).T - exact) / scale) < 1e-9
    seed = np.random.default_rng(1).normal(size=len(known))
    together = np.array(fmu.getDirectionalDerivative(unknown, known, list(seed)))
    assert together == pytest.approx(exact @ seed, rel=1e-9, abs=1e-9 * np.max(scale))


def test_adjoint_derivatives_are_the_transposed_ones(exported):
    for netlist in ("msl/rotational/CoupledClutches.toml", "dc_bench.toml"):
        case = exported(netlist, "3.0")
        fmu = case.started("me")
        fmu.updateDiscreteStates()
        known, unknown = known_and_unknown(case)
        random = np.random.default_rng(2)
        v, w = random.normal(size=len(known)), random.normal(size=len(unknown))
        forward = np.array(fmu.getDirectionalDerivative(unknown, known, list(v), len(unknown)))
        backward = np.array(fmu.getAdjointDerivative(unknown, known, list(w), len(known)))
        assert w @ forward == pytest.approx(backward @ v, rel=1e-11)


def test_directional_derivatives_agree_with_finite_differences(exported):
    case = exported("msl/rotational/CoupledClutches.toml")
    fmu = continuous(case)
    x = vector(fmu.fmi2GetContinuousStates, fmu, len(case.model.states))
    step = 1e-6
    for k in range(len(x)):
        sides = []
        for sign in (1, -1):
            moved = x.copy()
            moved[k] += sign * step
            fmu.fmi2SetContinuousStates(fmu.component, (ctypes.c_double * len(x))(*moved), len(x))
            sides.append(vector(fmu.fmi2GetDerivatives, fmu, len(x)))
        fmu.fmi2SetContinuousStates(fmu.component, (ctypes.c_double * len(x))(*x), len(x))
        found = fmu.getDirectionalDerivative(list(case.face.derivatives), [case.face.states[k]], [1.0])
        assert found == pytest.approx((sides[0] - sides[1]) / (2 * step), rel=1e-5, abs=1e-5)


def entered(case, **values):
    """An instance in initialization mode, with some values set."""
    fmu = case.instance("me")
    if case.version == "2.0":
        fmu.setupExperiment()
    fmu.enterInitializationMode()
    (fmu.setReal if case.version == "2.0" else fmu.setFloat64)([case.ref(name) for name in values], [*values.values()])
    return fmu


@pytest.mark.parametrize("version", ["2.0", "3.0"])
@pytest.mark.parametrize(
    "netlist", ["msl/rotational/First.toml", DRIVES[0], DRIVES[3], "components/universal_joint.toml"]
)
def test_directional_derivatives_during_the_initialization(exported, netlist, version):
    """By parameters and start values, also those from which states follow by equations; where no mode switches."""
    case = exported(netlist, version)
    floats, modes, count = ("getReal", "getInteger", 0) if version == "2.0" else ("getFloat64", "getInt64", 1)
    starts = [one.name for one in case.face.variables if one.start_entry is not None and one.initial == "exact"]
    known = [*starts, *(one.path for one in case.model.flat_parameters if one.tunable)]
    unknown = [*case.face.states, *case.face.derivatives]
    numbers = [one.reference for one in case.face.variables if one.modes]
    fmu = entered(case)
    compared = 0
    for name, value in zip(known, getattr(fmu, floats)([case.ref(name) for name in known]), strict=True):
        found = np.array(fmu.getDirectionalDerivative(unknown, [case.ref(name)], [1.0], *[len(unknown)] * count))
        if value in (case.face.by_name[name].min, case.face.by_name[name].max) and name not in starts:
            continue
        step = 1e-6 * (abs(value) or 1.0)
        low, high = (entered(case, **{name: value + side * step}) for side in (-1, 1))
        values = [np.array(getattr(one, floats)(unknown)) for one in (low, high)]
        if numbers and getattr(low, modes)(numbers) != getattr(high, modes)(numbers):
            continue
        exact = (values[1] - values[0]) / (2 * step)
        size = 1e-6 * np.abs(exact) + 1e-14 * np.max(np.abs(values)) / step + 1e-9  # truncation and rounding of `exact`
        np.testing.assert_array_less(np.abs(found - exact), size, err_msg=name)
        compared += 1
    assert compared > len(known) / 2
