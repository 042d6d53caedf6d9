"""The drive of a power chair: joystick, controller, motors, gears, parking brakes and battery."""
