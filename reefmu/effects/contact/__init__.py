"""Effects on the contacts themselves: their clearance, the material's modulus, the number of elements that carry."""
