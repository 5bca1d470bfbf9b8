"""The results of an acceptance for CI and readers: JUnit XML, an HTML report, results.json, the trend since a release."""

from drivetwin.hil_tests.results.acceptance import Acceptance
from drivetwin.hil_tests.results.junit import write_junit
from drivetwin.hil_tests.results.report_page import write_report
from drivetwin.hil_tests.results.results_file import read_results, write_results
from drivetwin.hil_tests.results.trend import Trend, check_baseline, compare

__all__ = [
    "Acceptance",
    "Trend",
    "check_baseline",
    "compare",
    "read_results",
    "write_junit",
    "write_report",
    "write_results",
]
