"""Springs and pendulums whose motion is known in closed form or was measured."""
