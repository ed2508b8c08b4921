"""How far a run is: a bar of tqdm, lines of text, or a function of the caller."""

from __future__ import annotations

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


def _display(until: float) -> tuple[Callable[[float, Any], None], Callable[[], None]]:
    """A bar of tqdm, which fits notebooks and terminals, or without tqdm a line every few seconds."""
    try:
        from tqdm.auto import tqdm
    except ImportError:
        last = [time.monotonic()]

        def line(share: float, state: Any) -> None:
            if time.monotonic() - last[0] >= INTERVAL:
                last[0] = time.monotonic()
                print(f"{100 * share:3.0f} %  time {state.time:.6g} of {until:.6g}  step {state.steps}", file=sys.stderr)

        return line, lambda: None
    bar = tqdm(total=100.0, bar_format="{l_bar}{bar}| {elapsed}<{remaining}{postfix}")

    def move(share: float, state: Any) -> None:
        bar.update(100.0 * min(share, 1.0) - bar.n)
        bar.set_postfix_str(f"time {state.time:.6g}, step {state.steps}")

    return move, bar.close
