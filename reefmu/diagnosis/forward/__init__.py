"""The torque that a base curve and effects predict over a whole record, with exact sensitivities.

* `base_curve`, `elastic`: drawing, curve file or power law, and its torque.
* `effect_functions`, `vectorised`, `trajectory`: equations and states of the effects over arrays.
* `record_contacts`, `record_states`, `record_stages`: the stages of `reefmu.model.stages.order` over a record.
* `parameter_layout`, `predictor`: the vector of all parameters, torque and sensitivities.
"""
