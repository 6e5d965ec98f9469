"""Sections of wheels and rails from drawings (DXF) and tables of coordinates (CSV): `railsqueal section`."""

from .command import Section, make
from .outline import Outline
from .placing import Options
from .properties import RailProperties, WheelProperties

__all__ = ["Options", "Outline", "RailProperties", "Section", "WheelProperties", "make"]
