"""Figures of a diagnosis, one a file. They draw `Diagnosis.evidence` and simulate nothing."""
