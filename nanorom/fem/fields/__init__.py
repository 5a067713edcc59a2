"""Values, slopes and stresses of functions at quadrature points and at places."""
