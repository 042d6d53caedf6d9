"""The test laboratory: the tests of the wheelchair standards (ISO 7176, EN 12184), on any chair.

Each test is one function of a `Design` and returns a `Result`: its numbers and its runs, from
which `Run.recording()` makes a recording. `perform` runs one by name; `run` runs many, several at
a time, and keeps them in a folder.
"""

from mjchair.testlab.design import Design
from mjchair.testlab.laboratory import TESTS, Request, chosen, perform, run
from mjchair.testlab.result import Result, Value

__all__ = ["TESTS", "Design", "Request", "Result", "Value", "chosen", "perform", "run"]
