"""How an individual drive of the population differs from the mean drive along a record: `responses` of one element to
deviations, `element_motion` along the record, `scatter` as random effects, simulated `individuals`."""
