"""How one drive of the population differs from the mean along a record: `responses` of one element to deviations,
`scatter` as random effects, `individuals` simulated along it."""
