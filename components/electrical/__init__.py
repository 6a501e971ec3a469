"""Circuits: their basic elements, switches, bridges, batteries and the coupling to motion."""

from components.electrical.analog import Capacitor as Capacitor
from components.electrical.analog import ConstantCurrent as ConstantCurrent
from components.electrical.analog import ConstantVoltage as ConstantVoltage
from components.electrical.analog import CurrentSensor as CurrentSensor
from components.electrical.analog import CurrentSink as CurrentSink
from components.electrical.analog import ElectricalPowerSensor as ElectricalPowerSensor
from components.electrical.analog import ElectricalSource as ElectricalSource
from components.electrical.analog import Ground as Ground
from components.electrical.analog import Inductor as Inductor
from components.electrical.analog import Pin as Pin
from components.electrical.analog import Resistor as Resistor
from components.electrical.analog import SignalCurrent as SignalCurrent
from components.electrical.analog import SignalVoltage as SignalVoltage
from components.electrical.analog import Switch as Switch
from components.electrical.analog import TwoPins as TwoPins
from components.electrical.analog import VariableResistor as VariableResistor
from components.electrical.analog import VoltageSensor as VoltageSensor
