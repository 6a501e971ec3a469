"""Heat and wear of clutches: the curve of VDI 2241, and the steady state against repeated engagements."""

from math import exp, inf, log

import pytest

from components.sizing import clutch_heat

HOUR = 3600.0


def test_permissible_work_and_frequency_are_points_of_one_curve() -> None:
    check = clutch_heat(3000.0, 100 / HOUR, 8000.0, 200 / HOUR, 90.0, 3.0)
    assert check.permissible_work == pytest.approx(8000 * (1 - exp(-2)))
    assert check.permissible_frequency * HOUR == pytest.approx(200 / log(8 / 5))
    at_limit = clutch_heat(3000.0, check.permissible_frequency, 8000.0, 200 / HOUR, 90.0, 3.0)
    assert at_limit.permissible_work == pytest.approx(3000.0)
    # Seldom engaged it may take the single work each time; often, the same heat flow Q_E·S_hü.
    assert clutch_heat(1.0, 1e-9, 8000.0, 0.1, 90.0, 3.0).permissible_work == pytest.approx(8000)
    assert clutch_heat(1e-3, 1e6, 8000.0, 0.1, 90.0, 3.0).permissible_work == pytest.approx(8000 * 0.1 / 1e6)


def test_steady_temperature_is_what_many_engagements_lead_to() -> None:
    check = clutch_heat(4000.0, 300 / HOUR, 8000.0, 200 / HOUR, 90.0, 3.0, air=300.0, wear_work=1e9)
    temperature = hot = 300.0
    for _ in range(400):
        hot = temperature + 4000.0 / 90.0
        temperature = 300.0 + (hot - 300.0) * exp(-3.0 * 12.0 / 90.0)
    assert check.temperature == pytest.approx(hot)
    assert check.power == pytest.approx(4000 / 12)
    assert check.engagements == pytest.approx(1e9 / 4000)
    assert check.hottest == inf


def test_more_work_than_a_single_engagement_may_have_is_refused() -> None:
    with pytest.raises(ValueError, match="not below single_limit"):
        clutch_heat(9000.0, 0.1, 8000.0, 0.1, 90.0, 3.0)
