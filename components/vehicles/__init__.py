"""Vehicles: tyres, resistances, engines and drivers."""

from components.vehicles.vehicle import RoadLoad as RoadLoad
from components.vehicles.vehicle import RollingResistance as RollingResistance
from components.vehicles.vehicle import Vehicle as Vehicle
