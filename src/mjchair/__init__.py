"""mjchair: a wheelchair simulator on MuJoCo with Magic Formula tires."""

from mjchair import tire
from mjchair.engine.install import install, installed, uninstall
from mjchair.errors import MjchairError
from mjchair.model.spec import load_spec

__all__ = ["MjchairError", "install", "installed", "load_spec", "tire", "uninstall"]
