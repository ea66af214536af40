"""The results of a check."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class CheckResult:
    """Result of one test. value: what was measured; the test passes where it is at most `limit`."""

    name: str
    passed: bool
    value: float
    limit: float
    detail: str = ""

    def __str__(self) -> str:
        status = "ok  " if self.passed else "FAIL"
        text = f"{status} {self.name}: {self.value:.3g} (at most {self.limit:.3g})"
        return f"{text}; {self.detail}" if self.detail else text


@dataclass(frozen=True)
class CheckReport:
    """All results of `check_fmu`, in the order of the tests."""

    path: Path
    results: tuple[CheckResult, ...]

    @property
    def passed(self) -> bool:
        """Whether every test passed."""
        return all(result.passed for result in self.results)

    def __getitem__(self, name: str) -> CheckResult:
        return next(result for result in self.results if result.name == name)

    def __str__(self) -> str:
        failed = sum(not result.passed for result in self.results)
        summary = "all passed" if not failed else f"{failed} of {len(self.results)} failed"
        return "\n".join([f"{self.path}: {summary}", *(f"  {result}" for result in self.results)])
