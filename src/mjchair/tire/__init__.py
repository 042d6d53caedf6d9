"""Tires: slip and load to forces and moments. Pure law and coefficient files, no engine."""

from mjchair.tire.files import read, write
from mjchair.tire.tire import Forces, Pac89, Tire

__all__ = ["Forces", "Pac89", "Tire", "read", "write"]
