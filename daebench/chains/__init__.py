"""Large constrained systems in which only neighbours meet: their functions are loops over nodes, and their cost is linear in them."""
