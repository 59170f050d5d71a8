# SPDX-License-Identifier: GPL-2.0-or-later
"""Common parts of plots: matplotlib without a window, colours, axes.

Colours are those of Okabe and Ito, which colour-blind people can distinguish; markers and line
styles should differ as well.
"""

from __future__ import annotations

from typing import Any

BLACK, BLUE, SKY, ORANGE = "#000000", "#0072B2", "#56B4E9", "#E69F00"
RED, GREEN, PURPLE, YELLOW, GREY = "#D55E00", "#009E73", "#CC79A7", "#F0E442", "#999999"


class PlotsMissing(Exception):
    """The reason in one line why there are no plots."""


ADVICE = "`tools/setup --tests` installs it, `benchmarks/series --report-only` makes them then"


def load_pyplot(style: dict[str, object] | None = None, advice: str = ADVICE) -> Any:
    """Returns matplotlib.pyplot without a window. Boards used only for measuring may lack it.

    `style` is rcParams; `advice` tells what to do if matplotlib is missing.
    """
    try:
        import matplotlib  # pylint: disable=import-outside-toplevel
        matplotlib.use("Agg")
        from matplotlib import pyplot  # pylint: disable=import-outside-toplevel
    except ImportError:
        raise PlotsMissing(f"no plots: matplotlib is missing; {advice}") from None
    pyplot.rcParams.update(style or {})
    return pyplot


def metres(value: float, _: object = None) -> str:
    """Formats a length on an axis."""
    if value < 1e-3:
        return f"{value * 1e6:g} µm"
    return f"{value * 1e3:g} mm" if value < 1 else f"{value:g} m"


def plain(value: float, _: object = None) -> str:
    return f"{value:g}" if value < 1e5 else f"{value:.0e}"


def set_log_axis(axis: object, formatter: object, low: float, high: float) -> None:
    """Places labels at 1, 2 and 5 on a short axis, otherwise at powers of ten."""
    from matplotlib.ticker import (  # pylint: disable=import-outside-toplevel
        FuncFormatter, LogLocator, NullFormatter)
    subs = (1.0, 2.0, 5.0) if high / max(low, 1e-12) < 200 else (1.0,)
    axis.set_major_locator(LogLocator(subs=subs, numticks=20))
    axis.set_major_formatter(FuncFormatter(formatter))
    axis.set_minor_formatter(NullFormatter())
