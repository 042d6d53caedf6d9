"""Identification: the coefficients of a tire from measurements on a tire test rig.

In: a table of rig runs (mjchair.measurement.rig). Out: a fitted tire with standard errors, the
parameters that these data do not determine, and the hidden errors of the rig that they support.
"""
