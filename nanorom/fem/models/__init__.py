"""Step I: the energies of films, and the forms made from them."""
