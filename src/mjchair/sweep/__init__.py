"""Many chairs over parameters, inputs and seeds, on the threads of one machine or on Dask."""

from mjchair.sweep.dataset import read
from mjchair.sweep.runner import run
from mjchair.sweep.study import Study, read_study

__all__ = ["Study", "read", "read_study", "run"]
