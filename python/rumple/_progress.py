"""How far a run is: a bar of tqdm, lines of text, or a function of the caller."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable
from typing import Any

#: Seconds between two lines of text.
INTERVAL = 5.0


def watched(
    observe: Callable[[Any], Any] | None, progress: bool | Callable[[float, Any], Any], until: float
) -> tuple[Callable[[Any], Any] | None, Callable[[], None]]:
    """An observer that shows the progress too, and what ends the display."""
    if not progress:
        return observe, lambda: None
    tell, close = (progress, lambda: None) if callable(progress) else _display(until)

    def both(state: Any) -> Any:
        tell(state.time / until if until > 0.0 else 1.0, state)
        return observe(state) if observe else False

    return both, close


def counted(progress: bool | Callable[[float, str], Any]) -> tuple[Callable[[str], None] | None, Callable[[], None]]:
    """What a study calls with a line for everything that happens, and what ends the display."""
    if not progress:
        return None, lambda: None
    share = [0.0]
    tell, close = (progress, lambda: None) if callable(progress) else _bar(lambda text: text)

    def line(text: str) -> None:
        if ended := re.match(r"\[(\d+)/(\d+)\] ", text):
            share[0] = int(ended[1]) / int(ended[2])
        tell(share[0], text)

    return line, close


def _display(until: float) -> tuple[Callable[[float, Any], None], Callable[[], None]]:
    """A bar for the state of a run."""
    return _bar(lambda state: f"time {state.time:.6g} of {until:.6g}, step {state.steps}", INTERVAL)


def _bar(words: Callable[[Any], str], interval: float = 0.0) -> tuple[Callable[[float, Any], None], Callable[[], None]]:
    """A bar of tqdm, which fits notebooks and terminals, or without tqdm a line, one in `interval` seconds at most."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        last = [time.monotonic()]

        def line(share: float, what: Any) -> None:
            if time.monotonic() - last[0] >= interval:
                last[0] = time.monotonic()
                print(f"{100 * share:3.0f} %  {words(what)}", file=sys.stderr)

        return line, lambda: None
    bar = tqdm(total=100.0, bar_format="{l_bar}{bar}| {elapsed}<{remaining}{postfix}")

    def move(share: float, what: Any) -> None:
        bar.update(100.0 * min(share, 1.0) - bar.n)
        bar.set_postfix_str(words(what))

    return move, bar.close
