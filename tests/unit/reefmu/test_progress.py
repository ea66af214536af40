"""Progress lines, and an executor that shows them."""

from __future__ import annotations

import pytest

from reefmu import progress as progress_module
from reefmu.progress import CountingExecutor, Progress


class Screen:
    """A stream that is a terminal or not."""

    def __init__(self, terminal: bool) -> None:
        self.text, self._terminal = "", terminal

    def isatty(self) -> bool:
        return self._terminal

    def write(self, text: str) -> int:
        self.text += text
        return len(text)

    def flush(self) -> None:
        pass


@pytest.mark.parametrize("terminal", [True, False])
def test_progress_rewrites_its_line_on_a_terminal_only(terminal: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(0, 1000, 10))
    monkeypatch.setattr(progress_module, "clock", lambda: float(next(clock)))
    screen = Screen(terminal)
    with Progress("counting", 4, screen) as progress:  # type: ignore[arg-type]
        for _ in range(4):
            progress.step()
    if terminal:
        assert "\n" not in screen.text
        assert screen.text.split("\r")[1].startswith("counting: 25 %")
        assert screen.text.endswith("\r\033[K")  # leaves nothing behind
    else:
        assert screen.text.splitlines() == [f"counting: {percent} %" for percent in (25, 50, 75, 100)]


def test_short_work_prints_nothing_to_a_file(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(range(100))
    monkeypatch.setattr(progress_module, "clock", lambda: float(next(clock)))
    screen = Screen(terminal=False)
    with Progress("counting", 2, screen) as progress:  # type: ignore[arg-type]
        progress.step()
        progress.step()
    assert screen.text == ""


def test_each_pass_of_a_work_states_its_number(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A percentage that falls without a word looks like a fault."""
    clock = iter(range(0, 1000, 10))
    monkeypatch.setattr(progress_module, "clock", lambda: float(next(clock)))
    with CountingExecutor("solving") as executor:
        for count in (2, 1, 2):
            list(executor.map(abs, range(count)))
    assert capsys.readouterr().err.splitlines() == [
        "solving: 50 %",
        "solving: 100 %",
        "solving, pass 2: 100 %",
        "solving, pass 3: 50 %",
        "solving, pass 3: 100 %",
    ]


def test_the_counting_executor_is_an_executor() -> None:
    with CountingExecutor("adding") as executor:
        assert list(executor.map(pow, [2, 3], [3, 2])) == [8, 9]
        assert executor.submit(pow, 2, 5).result() == 32
        with pytest.raises(ZeroDivisionError):
            executor.submit(lambda: 1 / 0).result()
