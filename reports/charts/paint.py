"""Colours, dashes, markers and hatches: those of Okabe and Ito.

A chart names its colours; on a page they are the page's variables with the light colour as fallback, on
paper the light colour itself.
"""

COLOURS = {
    "ink": "#1f2933",
    "muted": "#66727f",
    "grid": "#dde2e7",
    "paper": "#fefefe",
    "c1": "#0072b2",
    "c2": "#c46200",
    "c3": "#00805f",
    "c4": "#8e4585",
    "c5": "#c0392b",
    "c6": "#3a8fc4",
    "c7": "#7a5c1e",
}
# lengths of dash and gap; the first is a full line
DASHES = ("", "9 4", "3 3", "10 4 2.5 4", "1.5 2.5", "14 5", "6 2.5")
HATCHES = ("", "//", "--", "||", "\\\\", "+", "x")

MARKER_PATHS = {
    "o": "M-1 0a1 1 0 1 0 2 0a1 1 0 1 0-2 0z",
    "s": "M-.9-.9h1.8v1.8h-1.8z",
    "D": "M0-1.2L1.2 0L0 1.2L-1.2 0z",
    "^": "M0-1.1L1.1 .9H-1.1z",
    "v": "M0 1.1L1.1-.9H-1.1z",
    "<": "M-1.1 0L.9-1.1V1.1z",
    ">": "M1.1 0L-.9-1.1V1.1z",
    "+": "M-1 0H1M0-1V1",
    "x": "M-.8-.8L.8 .8M-.8 .8L.8-.8",
    ".": "M-.6 0a.6 .6 0 1 0 1.2 0a.6 .6 0 1 0-1.2 0z",
    "2": "M0 0V-1M0 0L-.87 .5M0 0L.87 .5",
}
HATCH_PATHS = {
    "//": "M-1 1L1-1M0 6L6 0M5 7L7 5",
    "\\\\": "M-1 5L1 7M0 0L6 6M5-1L7 1",
    "--": "M0 3H6",
    "||": "M3 0V6",
    "+": "M0 3H6M3 0V6",
    "x": "M0 0L6 6M0 6L6 0",
}


def paint(colour: str, page: bool) -> str:
    return f"var(--{colour},{COLOURS[colour]})" if page else COLOURS[colour]
