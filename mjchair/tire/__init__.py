"""Tires: from slip and load to forces and moments, and tire files. Nothing here needs MuJoCo."""

from mjchair.tire.files import read, write
from mjchair.tire.tire import Forces, Pac89, Tire

__all__ = ["Forces", "Pac89", "Tire", "read", "write"]
