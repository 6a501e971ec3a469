"""Gears, gearboxes, planetary sets, belts and chains, and the shifting of gears."""

from components.gears.ideal_gears import IdealGear as IdealGear
