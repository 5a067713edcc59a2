"""A string on a spring, which sets its Duffing coefficient."""

STRING = """
geometry = { shape = "string", length = "100 um", width = "2 um" }
plate = { thickness = "5 nm", model = "beam" }
material = { youngs_modulus = "250 GPa", poisson_ratio = 0.23, density = "3100 kg/m^3" }
tension = { x = "1 N/m", y = "0 N/m" }
support = { edge = { left = { spring = "1e4 N/m^2" }, right = "simply_supported" } }
modes = { count = 1 }
accuracy = { tolerance = 1e-6 }
"""
