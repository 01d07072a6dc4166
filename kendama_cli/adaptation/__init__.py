"""Search of the motion that catches: tau, size and aim, over perturbed simulations."""
