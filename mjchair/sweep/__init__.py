"""Sweeps: many simulations with different chairs and inputs, on one machine or a Dask cluster.

In: a `Study`, from Python or from a TOML file. Out: a table with one row for each simulation, kept
in a folder of Parquet files.
"""

from mjchair.sweep.dataset import read
from mjchair.sweep.measures import Sensed, standard
from mjchair.sweep.runner import run
from mjchair.sweep.study import Study, read_study

__all__ = ["Sensed", "Study", "read", "read_study", "run", "standard"]
