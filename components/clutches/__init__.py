"""Clutches and brakes, with the friction that holds them and the actuators that press them."""
