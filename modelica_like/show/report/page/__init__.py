"""Reports of runs: one page with schematic, events, curves, energies and numbers."""

from modelica_like.show.report.page.page import report as report
from modelica_like.show.report.page.page import save_report as save_report
