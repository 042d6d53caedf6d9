"""Formula families, one file each: steady-state forces from slip and load.

Each file ends with the record of its family (`Family`, in family.py, which says what the functions
take and give) and is registered in mjchair.tire.families.
"""
