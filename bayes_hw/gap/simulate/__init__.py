"""What the simulator knows: drive trains, springs, friction and paths as states in time."""
