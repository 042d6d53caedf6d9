"""Replays: a run in three dimensions, in one HTML file that opens from disk without a network.

In: a recording, and other recordings or measured runs to show beside it as ghosts. Out: the page.
`page.py` puts it together; `shapes.py` says what the bodies look like, `track.py` how they move,
`measured.py` how a measured chair moved; `packing.py` writes numbers into the page, and `viewer/`
is what runs in the browser.
"""
